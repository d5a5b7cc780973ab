/** Draw the view from behind a car: sky and floor, then what stands there, from the farthest to the nearest. */

import { NO_LED } from "../api/world";
import { carColour, hexColour, LEDS, pageFont, plateColour } from "./colours";
import { paintOrder, type SeenCar } from "./chaseOrder";
import { ChasePen } from "./chasePen";
import { thingsSeen } from "./chaseThings";
import type { Size } from "./camera";
import { listOf, type Mat, type Point } from "./document";
import { floorMarks, skyOver } from "./floors";
import { cornersOf, roadMarks } from "./marks";
import { aheadOf, circleAt, type Eye } from "./perspective";
import type { Sight } from "./scene";
import { DARK, LAMPS } from "./carPaint";

const FARTHEST_M = 14;
const NUMBERED_PX = 46;
const MOST_CARS = 250;
/** The bodies as they look from above, in half cars, counter-clockwise. */
const FOLLOWER: readonly Point[] = [[-0.92, -0.5], [-0.78, -0.64], [0.6, -0.64], [0.92, -0.3], [0.92, 0.3], [0.6, 0.64], [-0.78, 0.64], [-0.92, 0.5]];
const LEADER: readonly Point[] = [[-0.94, -0.5], [-0.78, -0.68], [0.4, -0.68], [0.86, -0.4], [1, 0], [0.86, 0.4], [0.4, 0.68], [-0.78, 0.68], [-0.94, 0.5]];

/** Paints the view; what is on a floor is computed once. */
export class ChasePainter {
  private readonly pen: ChasePen;
  private floor: { mat: Mat | null; look: string; areas: { corners: number[]; colour: string; alpha?: number }[] } = { mat: null, look: "", areas: [] };

  constructor(g: CanvasRenderingContext2D) {
    this.pen = new ChasePen(g);
  }

  paint(sight: Sight, eye: Eye, size: Size): void {
    const { pen } = this;
    pen.look(eye, size);
    this.paintSky(sight, size);
    this.paintFloor(sight);
    for (const { corners_m, centre_m, radius_m } of sight.zones) {
      const corners = centre_m ? circleAt(centre_m[0]!, centre_m[1]!, radius_m!) : corners_m.flatMap(([x, y]) => [x!, y!, 0]);
      pen.polygon(corners, sight.theme.accent, 0.25);
      pen.line([...corners, ...corners.slice(0, 3)], sight.theme.accent, 3);
    }
    for (const { x, y, radiusMm, widthPx, alpha } of sight.waves) {
      const corners = circleAt(x / 1000, y / 1000, radiusMm / 1000);
      pen.line([...corners, ...corners.slice(0, 3)], sight.theme.ring, widthPx, alpha);
    }
    for (const { paint } of paintOrder(eye, [...thingsSeen(pen, sight)], [...this.cars(sight)])) paint();
  }

  private paintSky({ theme, floor, contrast }: Sight, { width, height }: Size): void {
    const { g, lens } = this.pen;
    const [above, far] = skyOver(floor, theme);
    const sky = g.createLinearGradient(0, 0, 0, lens.horizon);
    sky.addColorStop(0, above);
    sky.addColorStop(1, far);
    g.globalAlpha = 1;
    g.fillStyle = sky;
    g.fillRect(0, 0, width, lens.horizon);
    g.fillStyle = theme.ground;
    g.fillRect(0, lens.horizon, width, height - lens.horizon);
    g.fillStyle = contrast ? "#ffffff" : theme.edge;
    g.fillRect(0, lens.horizon - 1, width, 1.5);
  }

  private paintFloor({ mat, floor, theme }: Sight): void {
    if (!mat) return;
    const look = `${floor} ${theme.floor} ${theme.grid}`;
    if (mat !== this.floor.mat || look !== this.floor.look) {
      const [width, height] = mat.size_m ?? [0, 0];
      const ground = { way: [[0, 0], [width, 0], [width, height], [0, height]] as Point[], widthM: 0, colour: theme.floor };
      const pattern = mat.size_m ? floorMarks(floor, mat.size_m, theme.grid, listOf(mat, "line").length > 0) : [];
      const areas = [ground, ...pattern, ...roadMarks(mat)].map((mark) => ({ ...mark, corners: cornersOf(mark) }));
      this.floor = { mat, look, areas };
    }
    for (const { corners, colour, alpha } of this.floor.areas) this.pen.polygon(corners, colour, alpha);
  }

  private *cars(sight: Sight): Generator<SeenCar> {
    const { drawn } = sight;
    const near: SeenCar[] = [];
    for (let k = 0; k < drawn.x.length; k++) {
      const [x, y] = [drawn.x[k]!, drawn.y[k]!];
      const ahead = aheadOf(this.pen.eye, x, y);
      if (ahead > 0.1 && ahead < FARTHEST_M) near.push({ ahead, at: [x, y], paint: () => this.car(sight, k) });
    }
    yield* near.length > MOST_CARS ? near.sort((a, b) => a.ahead - b.ahead).slice(0, MOST_CARS) : near;
  }

  private car({ drawn, picture, leads, carM, colours, contrast }: Sight, k: number): void {
    const [x, y, heading] = [drawn.x[k]!, drawn.y[k]!, drawn.heading[k]!];
    const half = (carM / 2) * (leads.has(k) ? 1.15 : 1);
    const [cos, sin] = [Math.cos(heading) * half, Math.sin(heading) * half];
    const at = (ahead: number, aside: number): Point => [x + ahead * cos - aside * sin, y + ahead * sin + aside * cos];
    const spot = (ahead: number, aside: number, z: number) => this.pen.spot(...at(ahead, aside), z * half);
    const px = half * this.pen.scaleAt(x, y);
    const fill = hexColour(picture && k < picture.cars ? carColour(colours, picture.index[k]!, picture.flags[k]!) : 0xc4c4c4);
    const rim = contrast ? "#ffffff" : DARK;
    this.pen.polygon(circleAt(x, y, half * 1.1), "#000000", contrast ? 0 : 0.22);
    for (const side of [0.72, -0.72]) {
      const wheel: Point[] = [at(-0.66, side - 0.16), at(0.54, side - 0.16), at(0.54, side + 0.16), at(-0.66, side + 0.16)];
      this.pen.prism(wheel, 0.5 * half, DARK, contrast ? rim : null);
    }
    const outline = (leads.has(k) ? LEADER : FOLLOWER).map(([ahead, aside]) => at(ahead, aside));
    this.pen.prism(outline, 0.78 * half, fill, rim, 0.24 * half);
    // What is behind the body is hidden by it: lights and eyes are on the side that they look to.
    if (aheadOf({ ...this.pen.eye, heading }, x, y) > 0) {
      for (const aside of [0.42, -0.42]) this.pen.mark(spot(-0.94, aside, 0.5), 0.12 * px, "#ff3b30", DARK);
      if (px > NUMBERED_PX / 2) this.number(spot(-0.94, 0, 0.5), k, px);
    } else {
      for (const aside of [0.25, -0.25]) {
        this.pen.mark(spot(0.9, aside, 0.55), 0.2 * px, "#ffffff", DARK);
        this.pen.mark(spot(0.92, aside, 0.55), 0.1 * px, "#7a1030", null);
      }
    }
    const led = picture && k < picture.cars ? picture.led[k]! : NO_LED;
    LAMPS.forEach(([ahead, aside], lamp) => {
      const lit = lamp === led;
      const colour = lit ? hexColour(LEDS[led]!) : "#dfe5ee";
      if (lit) this.pen.glow(spot(ahead, aside, 0.82), 0.9 * px, colour);
      this.pen.mark(spot(ahead, aside, 0.82), (lit ? 0.17 : 0.09) * px, colour, DARK);
    });
    if (!leads.has(k)) return;
    this.pen.line([...at(-0.36, 0), 0.78 * half, ...at(-0.36, 0), 1.5 * half], rim, Math.max(1.5, 0.09 * px));
    this.pen.mark(spot(-0.36, 0, 1.62), 0.2 * px, "#d62728", "#ffffff");
  }

  private number([x, y]: readonly number[], number: number, px: number): void {
    if (x === undefined || y === undefined) return;
    const { g } = this.pen;
    g.font = `700 ${Math.round(px * 0.42)}px ${pageFont()}`;
    g.textAlign = "center";
    g.textBaseline = "middle";
    this.pen.mark([x, y], 0.3 * px, plateColour(number), null);
    g.fillStyle = DARK;
    g.fillText(String(number), x, y);
  }
}
