/** A road through the stations of a path: to the right in even rows, back to the left in odd ones. */

export function stationAt(place: number, columns: number): { column: number; row: number } {
  const row = Math.floor(place / columns);
  const along = place % columns;
  return { column: row % 2 ? columns - 1 - along : along, row };
}

/** How far a turn reaches beyond the middle of its station, in stations. */
const TURN = 0.62;

/** The road as the path of a picture in which each station is 1 by 1. */
export function wayAlong(stations: number, columns: number): string {
  return Array.from({ length: stations }, (_, place) => {
    const { column, row } = stationAt(place, columns);
    const at = `${column + 0.5} ${row + 0.5}`;
    if (!place) return `M${at}`;
    if (place % columns) return `L${at}`;
    const beyond = column + 0.5 + (row % 2 ? TURN : -TURN);
    return `C${beyond} ${row - 0.5} ${beyond} ${row + 0.5} ${at}`;
  }).join("");
}
