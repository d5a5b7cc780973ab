/** Where the bubbles above cars have room. */

/** Between two bubbles. */
const AIR_PX = 4;

/** The first of the places of a bubble that meets none that is taken. */
export function freePlace(places: readonly DOMRect[], taken: readonly DOMRect[]): DOMRect | undefined {
  const meet = (a: DOMRect, b: DOMRect) =>
    a.x < b.x + b.width + AIR_PX && b.x < a.x + a.width + AIR_PX && a.y < b.y + b.height + AIR_PX && b.y < a.y + a.height + AIR_PX;
  return places.find((place) => taken.every((other) => !meet(other, place)));
}
