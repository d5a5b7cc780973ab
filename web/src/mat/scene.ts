/** The stage: what is seen, a camera, and a loop that paints only when something changed. */

import type { WorldHello, Picture } from "../api/world";
import type { MissionZone } from "../generated/messages";
import { inLanguage } from "../i18n";
import { isStart } from "../state/settings";
import { isCalm, sharpContext, watchSize } from "../ui/areas";
import { areWordsDue } from "../words/compiling";
import { Air } from "./air";
import { boxOfMat, boxOfZone, type Camera, RADIUS_M, shortestPx, type Size } from "./camera";
import { between, boxOf, boxOfRoads, type Cast, fitted, framed, isSame, isWellFramed } from "./framing";
import { CarLooks } from "./carLooks";
import { watchTheme, type WordColours } from "./colours";
import type { DanceMove } from "./dance";
import { floorOf, handlesOf, type Mat, pieceOf, type PieceId, type Point } from "./document";
import { Drawings } from "./drawings";
import { lookOf } from "./floors";
import { ROAD_COLOURS, ROAD_M } from "./marks";
import type { Miss } from "./missed";
import { Motion } from "./motion";
import { paint, type View, viewOf } from "./painter";
import { line, type Mark } from "./shapes";
import { Tracks } from "./tracks";
import { closedWay, LINE_M, ringOf, wayOf } from "./ways";
import { zoneNames } from "./zones";

/** In this time the camera goes most of its way. */
const FOLLOW_MS = 350;
/** A longer pause between two drawings doesn't make the camera jump. */
const MOST_PASSED_MS = 50;
/** Where a drawing takes longer, no positions between two pictures are drawn. */
const SLOW_MS = 14;
const HANDLE_PX = 18;
const HANDLE_RIM_PX = 3;
const HAIR_M = 0.0001;

interface SceneListeners {
  onCamera: (camera: Camera) => void;
  onDrawn: (frame: number) => void;
  /** The user took the camera, or gave it back. */
  onHeld: (held: boolean) => void;
}

export class Scene {
  readonly motion = new Motion();
  camera: Camera = { x: 2, y: 1.5, scale: 100 };
  size: Size = { width: 300, height: 150 };
  /** What is seen; views from another side draw it too. */
  view: View;
  /** How long a drawing takes, smoothed. */
  drawMs = 0;
  private readonly canvas = document.createElement("canvas");
  private readonly context: CanvasRenderingContext2D;
  private readonly tracks = new Tracks();
  private readonly air = new Air(isCalm);
  private readonly cars = new CarLooks();
  private readonly ends: (() => void)[] = [];
  private readonly drawnListeners = new Set<() => void>();
  private readonly drawings = new Drawings(() => (areWordsDue() ? this.draw() : this.drawNow()));
  private zones: readonly MissionZone[] = [];
  private all = false;
  private colours: WordColours = { strong: [], pale: [], byWord: new Map() };
  private chosen: PieceId | null = null;
  private stroke: readonly Point[] | null = null;
  private followed: number | null = null;
  /** Another view covers this one. */
  private covered = false;
  private undrawn = false;
  /** The camera frames the cars by itself; else the user holds it. */
  private frames = true;
  /** Where the camera is going. */
  private wanted: Camera | null = null;
  private wasFramed = false;
  private cameraMs = 0;
  private first = 0;

  constructor(
    readonly host: HTMLElement,
    private readonly listeners: SceneListeners,
  ) {
    this.context = this.canvas.getContext("2d", { alpha: false })!;
    this.canvas.setAttribute("aria-hidden", "true");
    this.canvas.className = "cover";
    this.canvas.style.touchAction = "none";
    host.prepend(this.canvas);
    this.view = { ...viewOf(null), tracks: this.tracks };
    this.ends.push(watchTheme(() => this.setTheme()));
    this.ends.push(watchSize(host, () => this.resize()));
    this.resize();
  }

  destroy(): void {
    this.drawings.stop();
    this.ends.forEach((end) => end());
    this.canvas.remove();
  }

  setHello(hello: WorldHello): void {
    const { cars, leads = [], radius_m = RADIUS_M, range_m = 1 } = hello;
    if (this.motion.picture?.cars !== cars) this.motion.forget();
    this.view.carM = 2 * radius_m;
    this.view.leastCarPx = shortestPx(cars);
    this.first = leads[0] ?? 0;
    this.wanted = null;
    this.cars.setCars(cars, new Set(leads), radius_m);
    this.air.setCars(leads);
    this.air.rangeM = range_m;
    this.tracks.clear();
    this.draw();
  }

  setMat(mat: Mat, chosen: PieceId | null): void {
    const before = floorOf(this.view.mat);
    this.view.mat = mat;
    this.chosen = chosen;
    if (floorOf(mat) !== before) this.setTheme();
    this.draw();
  }

  setZones(zones: readonly MissionZone[], all: boolean): void {
    this.all = all;
    this.zones = zones;
    this.view.zones = zones.map((zone) => ({ zone, name: inLanguage(zone.title), fits: false }));
    this.draw();
  }

  setColours(colours: WordColours): void {
    this.colours = colours;
    const { picture } = this.motion;
    if (picture) this.cars.take(picture, colours);
    this.draw();
  }

  /** Show what is being drawn as the road that it may become; null for nothing. */
  sketch(stroke: readonly Point[] | null): void {
    this.stroke = stroke;
    this.draw();
  }

  /** Write beside each of these cars what it counts. */
  count(texts: ReadonlyMap<number, string>): void {
    this.cars.write(texts);
    this.draw();
  }

  /** Ring the chosen car, and follow it where that is wished; ring the others that are told of. */
  choose(car: number | null, told: readonly number[], followed: boolean): void {
    this.air.chosen = car;
    this.view.ringed = new Set(car === null ? told : [car, ...told]);
    this.followed = followed ? car : null;
    this.draw();
  }

  /** Show the cars' tracks, what is in the air, and how far it reaches. */
  show(tracks: boolean, air: boolean, rangeM: number): void {
    this.tracks.shown = tracks;
    if (!tracks) this.tracks.clear();
    this.air.shown = air;
    this.air.rangeM = rangeM;
    this.draw();
  }

  /** Read the page's colours, with the chosen floor's own. */
  private setTheme(): void {
    Object.assign(this.view, lookOf(this.view.mat));
    this.draw();
  }

  /** Show a picture, and which words were missed. */
  take(picture: Picture, missed: readonly Miss[] = []): void {
    const now = performance.now();
    this.motion.take(picture, now);
    this.tracks.take(picture);
    this.cars.take(picture, this.colours);
    this.air.take(picture, now, (car) => isCalm() || this.cars.hear(car, now));
    // Who begins has not met lost messages yet.
    for (const { car, collided } of isStart() ? [] : missed) this.cars.lose(car, collided, now);
    this.undrawn = true;
    this.draw();
  }

  /** Give the camera back: it frames the cars by itself. */
  frame(): void {
    this.frames = true;
    this.wanted = null;
    this.listeners.onHeld(false);
    this.draw();
  }

  /** Frame the next picture's cars at once, whoever held the camera. */
  cut(): void {
    this.wasFramed = false;
    this.frame();
  }

  /** Show the whole mat. */
  showAll(): void {
    const { mat } = this.view;
    if (mat) this.look(fitted(boxOf(mat, this.motion.drawn.x, this.motion.drawn.y), this.size));
  }

  /** The user takes the camera. */
  look(camera: Camera): void {
    if (this.frames) this.listeners.onHeld(true);
    this.frames = false;
    this.camera = camera;
    this.draw();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.host;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.size = { width: clientWidth, height: clientHeight };
    this.canvas.style.width = `${clientWidth}px`;
    this.canvas.style.height = `${clientHeight}px`;
    sharpContext(this.canvas, clientWidth, clientHeight);
    // The canvas was cleared, and is shown before the next drawing.
    if (!this.covered) this.paint();
    this.wanted = null;
    this.draw();
  }

  /** Another view of the same moment covers this one, or no more. */
  cover(covered: boolean): void {
    this.covered = covered;
    this.draw();
  }

  /** Call back now and after each drawing; returns a function that ends this. */
  listen(listener: () => void): () => void {
    listener();
    this.drawnListeners.add(listener);
    return () => this.drawnListeners.delete(listener);
  }

  /** How long a car is painted, in pixels. */
  get carPx(): number {
    return Math.max(this.view.carM * this.camera.scale, this.view.leastCarPx);
  }

  /** Where the names of zones are on the stage. */
  nameBoxes(): DOMRect[] {
    const names = zoneNames(this.context, this.view.zones, this.camera, this.size);
    return names.map(({ lines, x, y, width, lineHeight }) => new DOMRect(x - width / 2, y, width, lines.length * lineHeight));
  }

  /** Ask for a drawing with the screen's next picture. */
  draw(): void {
    this.drawings.request();
  }

  /** Let leaders and followers dance, unless nothing may move. */
  celebrate(leader: readonly DanceMove[], followers: readonly DanceMove[]): void {
    if (!isCalm()) this.cars.celebrate(leader, followers, performance.now());
    this.draw();
  }

  /** The stage as it is now, as the address of a PNG. */
  png(): string {
    this.paint();
    return this.canvas.toDataURL("image/png");
  }

  private paint(): void {
    paint(this.context, this.view, this.camera, this.canvas.width / this.size.width);
  }

  private drawNow(): void {
    const now = performance.now();
    const slow = this.drawMs > SLOW_MS;
    const moves = this.motion.advance(slow ? Infinity : now);
    const follows = this.follow(now);
    const { drawn, picture } = this.motion;
    const fades = this.cars.advance(drawn, now, isCalm());
    const waves = this.air.waves(drawn, now, this.view.theme);
    this.view.cars = picture ? this.cars.looks : [];
    this.view.rings = [...this.air.ranges(drawn, this.view.theme), ...waves];
    this.view.above = this.grips();
    this.view.tMs = picture?.tMs ?? 0;
    if (!this.covered) this.paint();
    this.drawMs += (performance.now() - now - this.drawMs) / 8;
    this.listeners.onCamera(this.camera);
    for (const listener of this.drawnListeners) listener();
    if (this.undrawn && picture) this.listeners.onDrawn(picture.frame);
    this.undrawn = false;
    if (moves || waves.length || fades || follows) this.draw();
  }

  /** The outline and the handles of the chosen piece, and the road that is being drawn. */
  private grips(): Mark[] {
    const { mat, theme } = this.view;
    const marks: Mark[] = [];
    const piece = mat && this.chosen && pieceOf(mat, this.chosen);
    if (piece) {
      const points = handlesOf(piece);
      const outline = { widthM: HAIR_M, leastPx: HANDLE_RIM_PX, colour: theme.accent };
      if ("centre_m" in piece) marks.push({ ...outline, way: closedWay(ringOf(piece.centre_m, piece.radius_m, 40)) });
      else if ("points_m" in piece) marks.push({ ...outline, way: wayOf(piece) });
      else if (points.length > 1) marks.push({ ...outline, way: "corners_m" in piece ? closedWay(points) : points });
      for (const point of points) {
        marks.push({ ...outline, way: [point], leastPx: HANDLE_PX + HANDLE_RIM_PX });
        marks.push({ ...outline, way: [point], leastPx: HANDLE_PX - HANDLE_RIM_PX, colour: theme.floor });
      }
    }
    const { stroke } = this;
    if (stroke && stroke.length > 1) marks.push(line(stroke, ROAD_M, ROAD_COLOURS.bed, 0.7), line(stroke, LINE_M, ROAD_COLOURS.dark, 0.7));
    return marks;
  }

  /** Move the camera on; true while it isn't there yet. */
  private follow(now: number): boolean {
    const { drawn } = this.motion;
    const passed = now - this.cameraMs;
    this.cameraMs = now;
    const car = this.followed;
    if (car !== null && car < drawn.x.length) this.wanted = { ...this.camera, x: drawn.x[car]!, y: drawn.y[car]! };
    else if (!this.frames) return false;
    else this.wanted = this.wish();
    const { wanted } = this;
    if (!wanted || isSame(this.camera, wanted)) return false;
    const softly = this.wasFramed && !isCalm();
    this.wasFramed = true;
    this.camera = softly ? between(this.camera, wanted, 1 - Math.exp(-Math.min(passed, MOST_PASSED_MS) / FOLLOW_MS)) : wanted;
    return true;
  }

  /** Where the camera should go: it rests as long as it shows the cars well. */
  private wish(): Camera | null {
    if (this.motion.picture === null) return null;
    const { x, y } = this.motion.drawn;
    const { mat, carM } = this.view;
    const zones = this.zones.map(boxOfZone);
    const cast: Cast = { x, y, carM, first: this.first, zones, roads: mat && boxOfRoads(mat), mat: mat && boxOfMat(mat), all: this.all };
    return this.wanted && isWellFramed(this.wanted, cast, this.size) ? this.wanted : framed(cast, this.size);
  }
}
