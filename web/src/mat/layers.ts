/** The mat's floor, furniture and people, and the handles of the chosen piece. */

import { Container, Graphics, Sprite } from "pixi.js";
import { type FloorName, handlesOf, listOf, type Mat, type Person, personAt, pieceOf, type PieceId, type Point } from "./document";
import type { Textures } from "./textures";
import type { MatTheme } from "./colours";
import { floorMarks } from "./floors";
import { type Mark, ROAD_COLOURS, ROAD_M, roadMarks } from "./marks";
import { paintThings } from "./things";
import { LINE_M, wayOf } from "./ways";
import type { Picture } from "../api/world";

const WALL_MM = 24;
const PERSON_MM = 420;
const HANDLE_PX = 9;

export class FurnitureLayer {
  /** Below the cars. */
  readonly floor = new Container();
  /** Above them. */
  readonly above = new Container();
  private readonly ground = new Graphics();
  private readonly roads = new Graphics();
  private readonly pieces = new Graphics();
  private readonly handles = new Graphics();
  private readonly stroke = new Graphics();
  private readonly people = new Container<Sprite>();
  floorName: FloorName = "plain";
  private mat: Mat | null = null;
  private drawnFor = "";
  private chosen: PieceId | null = null;
  private stale = true;
  private groundLook = "";

  constructor(
    private readonly textures: Textures,
    private theme: MatTheme,
  ) {
    this.floor.addChild(this.ground, this.roads, this.pieces);
    this.above.addChild(this.people, this.handles, this.stroke);
  }

  setTheme(theme: MatTheme): void {
    this.theme = theme;
    this.stale = true;
  }

  setMat(mat: Mat, chosen: PieceId | null): void {
    this.mat = mat;
    this.chosen = chosen;
    this.stale = true;
  }

  /** Show what is being drawn as the road that it may become. */
  sketch(stroke: readonly Point[] | null): void {
    const g = this.stroke.clear();
    if (!stroke || stroke.length < 2) return;
    for (const [wide, color] of [[ROAD_M, ROAD_COLOURS.bed], [LINE_M, ROAD_COLOURS.dark]] as const) {
      g.poly(mm(stroke), false).stroke({ width: wide * 1000, color, alpha: 0.7, cap: "round", join: "round" });
    }
  }

  draw(scale: number, tMs: number): void {
    if (!this.mat) return;
    const drawnFor = scale.toPrecision(4);
    if (this.stale) this.drawGround(this.mat);
    if (this.stale || drawnFor !== this.drawnFor) {
      this.drawPieces(this.mat, scale);
      this.drawHandles(this.mat, scale);
      this.drawnFor = drawnFor;
      this.stale = false;
    }
    this.drawPeople(this.mat, tMs, scale);
  }

  private drawGround(mat: Mat): void {
    drawMarks(this.roads.clear(), roadMarks(mat));
    const hasRoads = listOf(mat, "line").length > 0;
    const look = JSON.stringify([mat.size_m, this.floorName, this.theme.floor, this.theme.grid, hasRoads]);
    // The pattern of a hall has thousands of shapes, and each step of a drag comes here.
    if (look === this.groundLook) return;
    this.groundLook = look;
    const g = this.ground.clear();
    if (!mat.size_m) return;
    const [width, height] = [mat.size_m[0] * 1000, mat.size_m[1] * 1000];
    g.rect(0, 0, width, height).fill(this.theme.floor);
    drawMarks(g, floorMarks(this.floorName, mat.size_m, this.theme.grid, hasRoads));
  }

  private drawEdge(mat: Mat, scale: number): void {
    if (!mat.size_m) return;
    const [width, height] = [mat.size_m[0] * 1000, mat.size_m[1] * 1000];
    const walled = mat.edge === "wall";
    this.pieces.rect(0, 0, width, height).stroke({
      width: walled ? Math.max(WALL_MM, 4 / scale) : 1.5 / scale,
      color: walled ? this.theme.wall : this.theme.edge,
      alignment: 0,
    });
  }

  private drawPieces(mat: Mat, scale: number): void {
    const g = this.pieces.clear();
    this.drawEdge(mat, scale);
    paintThings(g, this.floorName, mat, this.theme, { rim: 2 / scale, wall: Math.max(WALL_MM, 4 / scale) });
    for (const { centre_m, radius_m } of mat.voice ?? []) {
      if (centre_m && radius_m) g.circle(centre_m[0] * 1000, centre_m[1] * 1000, radius_m * 1000).stroke({ width: 1.5 / scale, color: this.theme.accent, alpha: 0.6 });
    }
  }

  private drawHandles(mat: Mat, scale: number): void {
    const g = this.handles.clear();
    const piece = this.chosen && pieceOf(mat, this.chosen);
    if (!piece) return;
    const around = { width: 3 / scale, color: this.theme.accent };
    const points = handlesOf(piece);
    if ("centre_m" in piece) g.circle(piece.centre_m[0] * 1000, piece.centre_m[1] * 1000, piece.radius_m * 1000);
    else if (points.length > 1) g.poly(mm("points_m" in piece ? wayOf(piece) : points), "corners_m" in piece);
    g.stroke(around);
    for (const [x, y] of points) g.circle(x * 1000, y * 1000, HANDLE_PX / scale).fill(this.theme.floor).stroke(around);
  }

  private drawPeople(mat: Mat, tMs: number, scale: number): void {
    const people = listOf(mat, "person");
    while (this.people.children.length < people.length) {
      const sprite = this.people.addChild(new Sprite(this.textures.person));
      sprite.anchor.set(0.5);
    }
    this.people.children.forEach((sprite, place) => {
      const person = people[place];
      sprite.visible = person !== undefined;
      if (person) this.drawPerson(sprite, person, tMs, scale);
    });
  }

  private drawPerson(sprite: Sprite, person: Person, tMs: number, scale: number): void {
    const [x, y] = personAt(person, tMs);
    const [nextX, nextY] = personAt(person, tMs + 50);
    if (nextX !== x || nextY !== y) sprite.rotation = Math.atan2(nextY - y, nextX - x);
    sprite.tint = this.theme.person;
    sprite.position.set(x * 1000, y * 1000);
    sprite.scale.set(Math.max(PERSON_MM, 14 / scale) / sprite.texture.width);
  }
}

/** Draw marks, those that follow each other and look alike as one shape: each shape takes time in each picture. */
function drawMarks(g: Graphics, marks: readonly Mark[]): void {
  // Pixi takes an alpha of undefined for no number, and WebGL then draws nothing.
  marks.forEach(({ way, widthM, colour: color, alpha = 1 }, k) => {
    g.poly(mm(way), !widthM);
    const next = marks[k + 1];
    if (next?.colour === color && next.widthM === widthM && (next.alpha ?? 1) === alpha) return;
    if (widthM) g.stroke({ width: widthM * 1000, color, alpha, cap: "round", join: "round" });
    else g.fill({ color, alpha });
  });
}

/** Points in millimetres, as x and y of each. */
export const mm = (points: readonly (readonly number[])[]): number[] => points.flatMap(([x, y]) => [x! * 1000, y! * 1000]);

const STEP_M = 0.04;
const LIFTED_M = 1;
const LINES_A_STRIP = 600;
const MOST_STRIPS = 60;

/** The paths of all cars, in strips: when there are too many, the oldest strip goes. */
export class TrackLayer {
  readonly view = new Container();
  private lastX = new Float32Array();
  private lastY = new Float32Array();
  private lastMs = 0;
  /** The paths of the open strip, each as x and y of its points in millimetres, and which is each car's. */
  private paths: number[][] = [];
  private pathOf: (number[] | undefined)[] = [];
  private lines = 0;
  private open: Graphics | null = null;
  shown = true;

  constructor(theme: MatTheme) {
    this.setTheme(theme);
  }

  setTheme(theme: MatTheme): void {
    this.view.tint = theme.track;
  }

  clear(): void {
    for (const strip of this.view.removeChildren()) strip.destroy();
    this.lastX = this.lastY = new Float32Array();
    this.closeStrip();
  }

  private closeStrip(): void {
    this.paths = [];
    this.pathOf = [];
    this.lines = 0;
    this.open = null;
  }

  take(picture: Picture): void {
    if (picture.past || !this.shown) return;
    // A car that moves while time stands still is moved by the user.
    const isMovedByUser = picture.tMs === this.lastMs;
    this.lastMs = picture.tMs;
    if (picture.fresh || isMovedByUser || this.lastX.length !== picture.cars) {
      if (!isMovedByUser) this.clear();
      this.lastX = picture.x.slice();
      this.lastY = picture.y.slice();
      return;
    }
    const before = this.lines;
    for (let k = 0; k < picture.cars; k++) this.follow(k, picture.x[k]!, picture.y[k]!);
    if (this.lines > before) this.drawStrip();
  }

  private follow(k: number, x: number, y: number): void {
    const distance = Math.hypot(x - this.lastX[k]!, y - this.lastY[k]!);
    if (distance < STEP_M) return;
    if (distance < LIFTED_M) this.draw(k, x, y);
    else this.pathOf[k] = undefined;
    this.lastX[k] = x;
    this.lastY[k] = y;
  }

  private draw(k: number, x: number, y: number): void {
    let path = this.pathOf[k];
    if (!path) {
      path = this.pathOf[k] = [this.lastX[k]! * 1000, this.lastY[k]! * 1000];
      this.paths.push(path);
    }
    path.push(x * 1000, y * 1000);
    this.lines += 1;
  }

  private drawStrip(): void {
    this.open ??= this.view.addChild(new Graphics());
    this.open.clear();
    // A path is one shape: a shape for each of its lines would take half a kilobyte of memory a line.
    for (const path of this.paths) this.open.poly(path, false);
    this.open.stroke({ width: 14, color: 0xffffff });
    if (this.lines < LINES_A_STRIP) return;
    this.closeStrip();
    const strips = this.view.children;
    if (strips.length > MOST_STRIPS) this.view.removeChildAt(0).destroy();
    strips.forEach((strip, place) => (strip.alpha = 1 - (strips.length - place) / (MOST_STRIPS + 4)));
  }
}
