/** The mat's floor, furniture and people, and the handles of the chosen piece. */

import { Container, Graphics, Sprite } from "pixi.js";
import { type Disc, handlesOf, listOf, type Mat, type Person, personAt, pieceOf, type PieceId, type Polygon } from "./document";
import type { Textures } from "./textures";
import type { MatTheme } from "./colours";

const WALL_MM = 24;
const PERSON_MM = 420;
const MOST_GRID_LINES = 200;
export const HANDLE_PX = 9;

export class FurnitureLayer {
  /** Below the cars. */
  readonly floor = new Container();
  /** Above them. */
  readonly above = new Container();
  private readonly ground = new Graphics();
  private readonly pieces = new Graphics();
  private readonly handles = new Graphics();
  private readonly people = new Container<Sprite>();
  private mat: Mat | null = null;
  private drawnFor = "";
  private chosen: PieceId | null = null;
  private stale = true;

  constructor(
    private readonly textures: Textures,
    private theme: MatTheme,
  ) {
    this.floor.addChild(this.ground, this.pieces);
    this.above.addChild(this.people, this.handles);
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

  draw(scale: number, tMs: number): void {
    if (!this.mat) return;
    const drawnFor = scale.toPrecision(4);
    if (this.stale || drawnFor !== this.drawnFor) {
      this.drawGround(this.mat, scale);
      this.drawPieces(this.mat, scale);
      this.drawHandles(this.mat, scale);
      this.drawnFor = drawnFor;
      this.stale = false;
    }
    this.drawPeople(this.mat, tMs, scale);
  }

  private drawGround(mat: Mat, scale: number): void {
    const g = this.ground.clear();
    if (!mat.size_m) return;
    const [width, height] = [mat.size_m[0] * 1000, mat.size_m[1] * 1000];
    g.rect(0, 0, width, height).fill(this.theme.floor);
    const step = [500, 1000, 5000, 10_000, 100_000].find((each) => (width + height) / each < MOST_GRID_LINES) ?? 1e6;
    for (let x = step; x < width; x += step) g.moveTo(x, 0).lineTo(x, height);
    for (let y = step; y < height; y += step) g.moveTo(0, y).lineTo(width, y);
    g.stroke({ width: 1 / scale, color: this.theme.grid });
    const walled = mat.edge === "wall";
    g.rect(0, 0, width, height).stroke({
      width: walled ? Math.max(WALL_MM, 4 / scale) : 1.5 / scale,
      color: walled ? this.theme.wall : this.theme.edge,
      alignment: 0,
    });
  }

  private drawPieces(mat: Mat, scale: number): void {
    const g = this.pieces.clear();
    const rim = { width: 2 / scale, color: this.theme.wall };
    for (const { corners_m } of listOf(mat, "polygon")) outline(g, { corners_m }).fill(this.theme.obstacle).stroke(rim);
    for (const { centre_m, radius_m } of listOf(mat, "disc")) {
      g.circle(centre_m[0] * 1000, centre_m[1] * 1000, radius_m * 1000).fill(this.theme.obstacle).stroke(rim);
    }
    for (const { from_m, to_m } of listOf(mat, "wall")) {
      g.moveTo(from_m[0] * 1000, from_m[1] * 1000).lineTo(to_m[0] * 1000, to_m[1] * 1000);
    }
    for (const { centre_m, radius_m } of mat.voice ?? []) {
      if (centre_m && radius_m) g.circle(centre_m[0] * 1000, centre_m[1] * 1000, radius_m * 1000).stroke({ width: 1.5 / scale, color: this.theme.accent, alpha: 0.6 });
    }
    if (mat.wall?.length) g.stroke({ width: Math.max(WALL_MM, 4 / scale), color: this.theme.wall, cap: "round" });
  }

  private drawHandles(mat: Mat, scale: number): void {
    const g = this.handles.clear();
    const piece = this.chosen && pieceOf(mat, this.chosen);
    if (!this.chosen || !piece) return;
    const around = { width: 3 / scale, color: this.theme.accent };
    const { kind } = this.chosen;
    if (kind === "polygon") outline(g, piece as Polygon).stroke(around);
    if (kind === "disc") {
      const { centre_m, radius_m } = piece as Disc;
      g.circle(centre_m[0] * 1000, centre_m[1] * 1000, radius_m * 1000).stroke(around);
    }
    const points = handlesOf(kind, piece);
    if (kind === "wall" || kind === "person") {
      points.forEach(([x, y], place) => (place ? g.lineTo(x * 1000, y * 1000) : g.moveTo(x * 1000, y * 1000)));
      g.stroke(around);
    }
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

function outline(g: Graphics, { corners_m }: Polygon): Graphics {
  return g.poly(corners_m.flatMap(([x, y]) => [x * 1000, y * 1000]));
}

