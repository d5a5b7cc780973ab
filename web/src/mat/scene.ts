/** The drawn mat: layers, a camera, and a loop that draws only when something changed. */

import "pixi.js/unsafe-eval";
import { CanvasRenderer, Container, type Renderer, Ticker, WebGLRenderer } from "pixi.js";
import type { WorldHello, Picture } from "../api/world";
import { useSettings } from "../state/settings";
import { isCalm, watchSize } from "../ui/areas";
import { AirLayer } from "./airLayer";
import { FurnitureLayer, TrackLayer } from "./layers";
import { between, boxOf, boxOfMat, boxOfRoads, boxOfZone, type Camera, type Cast, fitted, framed, isSame, isWellFramed, type Size } from "./camera";
import { CarLayer, Motion } from "./carLayer";
import { type WordColours, type MatTheme, readTheme, watchTheme } from "./colours";
import type { DanceMove } from "./dance";
import { type FloorName, floorOf, type Mat, type PieceId, type Point } from "./document";
import { withFloor } from "./floors";
import { Drawings, hasFastWebGl } from "./graphics";
import { makeTextures } from "./textures";
import { areWordsDue } from "../words/compiling";
import { ZoneLayer } from "./zoneLayer";
import type { MissionZone } from "../generated/messages";

/** In this time the camera goes most of its way. */
const FOLLOW_MS = 350;
/** A longer pause between two drawings doesn't make the camera jump. */
const MOST_PASSED_MS = 50;
/** High contrast has no pictures on the floor. */
function isContrast(): boolean {
  return useSettings.getState().theme === "contrast" || matchMedia("(forced-colors: active)").matches;
}

/** What a view from another side draws. */
export type Sight = ReturnType<Scene["sight"]>;

/** Where a drawing takes longer, no positions between two pictures are drawn. */
const SLOW_MS = 14;

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
  private followed: number | null = null;
  /** How long a drawing takes, smoothed. */
  drawMs = 0;
  /** Another view covers this one. */
  private covered = false;
  private readonly stage = new Container();
  private readonly world = new Container();
  private readonly furniture: FurnitureLayer;
  readonly zones: ZoneLayer;
  private readonly tracks: TrackLayer;
  private readonly air: AirLayer;
  private readonly cars: CarLayer;
  private readonly ends: (() => void)[] = [];
  private readonly drawnListeners = new Set<() => void>();
  private theme: MatTheme;
  private all = false;
  private colours: WordColours = { strong: [], pale: [], byWord: new Map() };
  private mat: Mat | null = null;
  private readonly drawings = new Drawings(() => (areWordsDue() ? this.draw() : this.drawNow()));
  private undrawn = false;
  /** The camera frames the cars by itself; else the user holds it. */
  private frames = true;
  /** Where the camera is going. */
  private wanted: Camera | null = null;
  private wasFramed = false;
  private cameraMs = 0;
  private carM = 0.15;
  private first = 0;

  private constructor(
    private readonly renderer: Renderer,
    readonly host: HTMLElement,
    private readonly listeners: SceneListeners,
  ) {
    const theme = (this.theme = this.readTheme());
    const textures = makeTextures();
    this.furniture = new FurnitureLayer(textures, theme);
    this.zones = new ZoneLayer(theme);
    this.tracks = new TrackLayer(theme);
    this.air = new AirLayer(theme, isCalm);
    this.cars = new CarLayer(textures, theme);
    this.world.addChild(this.furniture.floor, this.zones.view, this.tracks.view, this.air.view, this.cars.view, this.furniture.above);
    this.stage.addChild(this.world);
    this.ends.push(watchTheme(() => this.setTheme(this.readTheme())));
    this.setTheme(theme);
    this.ends.push(watchSize(host, () => this.resize()));
    this.resize();
  }

  static async create(host: HTMLElement, listeners: SceneListeners): Promise<Scene> {
    // Without a graphics processor a canvas is drawn ten times as fast as WebGL.
    const renderer = hasFastWebGl() ? new WebGLRenderer() : new CanvasRenderer();
    await renderer.init({
      antialias: true,
      autoDensity: true,
      resolution: Math.min(2, devicePixelRatio),
      // This canvas has its own pointers, keys and labels.
      eventFeatures: { move: false, globalMove: false, click: false, wheel: false },
      accessibilityOptions: { activateOnTab: false },
    });
    // What Pixi does from time to time comes with our drawings: it would wake the page for each picture of the screen.
    Ticker.system.autoStart = false;
    Ticker.system.stop();
    const canvas = renderer.canvas;
    canvas.style.touchAction = "none";
    canvas.setAttribute("aria-hidden", "true");
    host.prepend(canvas);
    return new Scene(renderer, host, listeners);
  }

  destroy(): void {
    this.drawings.stop();
    this.ends.forEach((end) => end());
    this.renderer.canvas.remove();
    this.stage.destroy({ children: true });
    this.renderer.destroy();
  }

  setHello(hello: WorldHello): void {
    const { cars, leads = [], radius_m = 0.075, range_m = 1 } = hello;
    if (this.motion.picture?.cars !== cars) this.motion.forget();
    this.carM = 2 * radius_m;
    this.first = leads[0] ?? 0;
    this.wanted = null;
    this.cars.setCars(cars, new Set(leads), radius_m);
    this.air.setCars(leads);
    this.air.setRange(range_m);
    this.tracks.clear();
    this.draw();
  }

  setMat(mat: Mat, chosen: PieceId | null): void {
    const before = this.floor;
    this.mat = mat;
    if (this.floor !== before) this.setTheme(this.readTheme());
    this.furniture.setMat(mat, chosen);
    this.draw();
  }

  setZones(zones: readonly MissionZone[], all: boolean): void {
    this.all = all;
    this.zones.setZones(zones);
    this.draw();
  }

  setColours(colours: WordColours): void {
    this.colours = colours;
    const { picture } = this.motion;
    if (picture) this.cars.take(picture, colours);
    this.draw();
  }

  /** Show what is being drawn; null for nothing. */
  sketch(stroke: readonly Point[] | null): void {
    this.furniture.sketch(stroke);
    this.draw();
  }

  /** Ring the chosen car, and follow it where that is wished; ring the others that are told of. */
  choose(car: number | null, told: readonly number[], followed: boolean): void {
    this.air.chosen = car;
    this.cars.ringed = car === null ? told : [car, ...told];
    this.followed = followed ? car : null;
    this.draw();
  }

  /** Show the cars' tracks, what is in the air, and how far it reaches. */
  show(tracks: boolean, air: boolean, rangeM: number): void {
    this.tracks.shown = tracks;
    if (!tracks) this.tracks.clear();
    this.air.shown = air;
    this.air.setRange(rangeM);
    this.draw();
  }

  /** With the chosen floor's colours; high contrast has none. */
  private readTheme(): MatTheme {
    return withFloor(readTheme(this.host), this.floor);
  }

  private get floor(): FloorName {
    return isContrast() ? "plain" : floorOf(this.mat);
  }

  private setTheme(theme: MatTheme): void {
    this.theme = theme;
    this.furniture.floorName = this.floor;
    this.cars.setContrast(isContrast());
    this.renderer.background.color = theme.ground;
    for (const layer of [this.furniture, this.zones, this.tracks, this.air, this.cars]) layer.setTheme(theme);
    this.draw();
  }

  take(picture: Picture): void {
    const now = performance.now();
    this.motion.take(picture, now);
    this.tracks.take(picture);
    this.cars.take(picture, this.colours);
    this.air.take(picture, now, {
      // Who begins has not met lost messages yet.
      onLost: (car, collided) => useSettings.getState().level !== "start" && this.cars.lose(car, collided, now),
      onHeard: (car) => isCalm() || this.cars.hear(car, now),
    });
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
    if (this.mat) this.look(fitted(boxOf(this.mat, this.motion.drawn.x, this.motion.drawn.y), this.size));
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
    this.renderer.resize(clientWidth, clientHeight);
    this.wanted = null;
    this.draw();
  }

  /** Another view of the same moment covers this one, or no more. */
  cover(covered: boolean): void {
    this.covered = covered;
    this.draw();
  }

  /** What is to be seen now, for a view from another side. */
  sight() {
    const { mat, carM, colours, theme, floor } = this;
    const { drawn, picture } = this.motion;
    const { zones } = this.zones;
    const { leads } = this.cars;
    const waves = this.air.waves(drawn, performance.now());
    return { mat, zones, drawn, picture, leads, carM, colours, theme, floor, contrast: isContrast(), waves };
  }

  /** Call back now and after each drawing; returns a function that ends this. */
  listen(listener: () => void): () => void {
    listener();
    this.drawnListeners.add(listener);
    return () => this.drawnListeners.delete(listener);
  }

  /** How long a car is on the screen, in pixels. */
  get carPx(): number {
    return this.carM * this.camera.scale;
  }

  /** Ask for a drawing with the screen's next picture. */
  draw(): void {
    this.drawings.request();
  }

  /** Let leaders and followers dance. */
  celebrate(leader: readonly DanceMove[], followers: readonly DanceMove[]): void {
    this.cars.celebrate(leader, followers, performance.now());
    this.draw();
  }

  /** The stage as it is now, as the address of a PNG. */
  png(): string {
    // A canvas of WebGL keeps its picture only until the end of the task that drew it.
    this.renderer.render(this.stage);
    return this.renderer.canvas.toDataURL("image/png");
  }

  private drawNow(): void {
    const now = performance.now();
    Ticker.system.update(now);
    const slow = this.drawMs > SLOW_MS;
    const moves = this.motion.advance(slow ? Infinity : now);
    const follows = this.follow(now);
    this.place();
    const scale = this.camera.scale / 1000;
    const { drawn, picture } = this.motion;
    this.furniture.draw(scale, picture?.tMs ?? 0);
    this.zones.draw(scale);
    const grows = this.air.draw(drawn, scale, now);
    this.cars.still = isCalm();
    const fades = this.cars.draw(drawn, picture, scale, now);
    if (!this.covered) this.renderer.render(this.stage);
    this.drawMs += (performance.now() - now - this.drawMs) / 8;
    this.listeners.onCamera(this.camera);
    for (const listener of this.drawnListeners) listener();
    if (this.undrawn && picture) this.listeners.onDrawn(picture.frame);
    this.undrawn = false;
    if (moves || grows || fades || follows) this.draw();
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
    const { x, y } = this.motion.drawn;
    if (this.motion.picture === null) return null;
    const cast: Cast = { x, y, carM: this.carM, first: this.first, zones: this.zones.zones.map(boxOfZone), roads: this.mat && boxOfRoads(this.mat), mat: this.mat && boxOfMat(this.mat), all: this.all };
    return this.wanted && isWellFramed(this.wanted, cast, this.size) ? this.wanted : framed(cast, this.size);
  }

  private place(): void {
    const { x, y, scale } = this.camera;
    const { width, height } = this.size;
    this.world.scale.set(scale / 1000, -scale / 1000);
    this.world.position.set(width / 2 - x * scale, height / 2 + y * scale);
  }
}
