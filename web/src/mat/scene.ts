/** The drawn mat: layers, a camera, and a loop that draws only when something changed. */

import "pixi.js/unsafe-eval";
import { autoDetectRenderer, Container, type Renderer } from "pixi.js";
import type { Hello, Picture } from "../api/world";
import { AirLayer, TrackLayer, FurnitureLayer } from "./layers";
import { boxOf, type Camera, fitted, type Size } from "./camera";
import { CarLayer, Motion } from "./carLayer";
import { type WordColours, type MatTheme, readTheme, watchTheme } from "./colours";
import type { Mat, PieceId } from "./document";
import { makeTextures } from "./textures";

/** Where a drawing takes longer, no positions between two pictures are drawn. */
const SLOW_MS = 14;

export interface SceneListeners {
  onCamera: (camera: Camera) => void;
  onDrawn: (frame: number) => void;
}

export class Scene {
  readonly motion = new Motion();
  camera: Camera = { x: 2, y: 1.5, scale: 100 };
  size: Size = { width: 300, height: 150 };
  followed: number | null = null;
  /** How long a drawing takes, smoothed. */
  drawMs = 0;

  private readonly stage = new Container();
  private readonly world = new Container();
  private readonly furniture: FurnitureLayer;
  private readonly tracks: TrackLayer;
  private readonly air: AirLayer;
  private readonly cars: CarLayer;
  private readonly ends: (() => void)[] = [];
  private colours: WordColours = { strong: [], pale: [], byWord: new Map() };
  private mat: Mat | null = null;
  private requested = 0;
  private undrawn = false;
  private untouched = true;

  private constructor(
    private readonly renderer: Renderer,
    readonly host: HTMLElement,
    private readonly listeners: SceneListeners,
  ) {
    const theme = readTheme(host);
    const textures = makeTextures();
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    this.furniture = new FurnitureLayer(textures, theme);
    this.tracks = new TrackLayer(theme);
    this.air = new AirLayer(textures, theme, () => calm.matches);
    this.cars = new CarLayer(textures, theme);
    this.world.addChild(this.furniture.floor, this.tracks.view, this.air.view, this.cars.view, this.furniture.above);
    this.stage.addChild(this.world);
    this.ends.push(watchTheme(() => this.setTheme(readTheme(host))));
    this.setTheme(theme);
    const observer = new ResizeObserver(() => this.resize());
    observer.observe(host);
    this.ends.push(() => observer.disconnect());
    this.resize();
  }

  static async create(host: HTMLElement, listeners: SceneListeners): Promise<Scene> {
    const renderer = await autoDetectRenderer({
      preference: ["webgl", "canvas"],
      antialias: true,
      autoDensity: true,
      resolution: Math.min(2, devicePixelRatio),
      // This canvas has its own pointers, keys and labels.
      eventFeatures: { move: false, globalMove: false, click: false, wheel: false },
      accessibilityOptions: { activateOnTab: false },
    });
    const canvas = renderer.canvas;
    canvas.style.touchAction = "none";
    canvas.setAttribute("aria-hidden", "true");
    host.prepend(canvas);
    return new Scene(renderer, host, listeners);
  }

  destroy(): void {
    cancelAnimationFrame(this.requested);
    this.ends.forEach((end) => end());
    this.renderer.canvas.remove();
    this.stage.destroy({ children: true });
    this.renderer.destroy();
  }

  setHello(hello: Hello): void {
    const { cars, leads = [], radius_m = 0.075, range_m = 1 } = hello;
    if (this.motion.picture?.cars !== cars) this.motion.forget();
    this.cars.setCars(cars, new Set(leads), radius_m);
    this.air.setCars(leads);
    this.air.setRange(range_m);
    this.tracks.clear();
    this.draw();
  }

  setMat(mat: Mat, chosen: PieceId | null): void {
    const resized = this.mat?.size_m?.join() !== mat.size_m?.join();
    this.mat = mat;
    this.furniture.setMat(mat, chosen);
    if (resized && this.untouched) this.fit();
    this.draw();
  }

  setColours(colours: WordColours): void {
    this.colours = colours;
    const { picture } = this.motion;
    if (picture) this.cars.take(picture, colours);
    this.draw();
  }

  setRange(metres: number): void {
    this.air.setRange(metres);
    this.draw();
  }

  choose(car: number | null): void {
    this.cars.chosen = this.air.chosen = car;
    this.draw();
  }

  show(what: { tracks: boolean; air: boolean }): void {
    this.tracks.shown = what.tracks;
    if (!what.tracks) this.tracks.clear();
    this.air.shown = what.air;
    this.draw();
  }

  private setTheme(theme: MatTheme): void {
    this.renderer.background.color = theme.ground;
    for (const layer of [this.furniture, this.tracks, this.air, this.cars]) layer.setTheme(theme);
    this.draw();
  }

  take(picture: Picture): void {
    const now = performance.now();
    const first = this.motion.picture === null;
    this.motion.take(picture, now);
    this.tracks.take(picture);
    this.cars.take(picture, this.colours);
    this.air.take(picture, now, (car, collided) => this.cars.lose(car, collided, now));
    this.undrawn = true;
    if (first && !this.mat?.size_m) this.fit();
    this.draw();
  }

  fit(): void {
    const { picture } = this.motion;
    this.untouched = true;
    if (this.mat) this.camera = fitted(boxOf(this.mat, picture?.x ?? [], picture?.y ?? []), this.size);
    this.draw();
  }

  look(camera: Camera): void {
    this.untouched = false;
    this.camera = camera;
    this.draw();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.host;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.size = { width: clientWidth, height: clientHeight };
    this.renderer.resize(clientWidth, clientHeight);
    if (this.untouched) this.fit();
    this.draw();
  }

  /** Ask for a drawing with the screen's next picture. */
  draw(): void {
    if (!this.requested) this.requested = requestAnimationFrame(() => this.drawNow());
  }

  private drawNow(): void {
    this.requested = 0;
    const now = performance.now();
    const slow = this.drawMs > SLOW_MS;
    const moves = this.motion.advance(slow ? Infinity : now);
    this.follow();
    this.place();
    const scale = this.camera.scale / 1000;
    const { drawn, picture } = this.motion;
    this.furniture.draw(scale, picture?.tMs ?? 0);
    const grows = this.air.draw(drawn, scale, now);
    const fades = this.cars.draw(drawn, scale, now);
    this.renderer.render(this.stage);
    this.drawMs += (performance.now() - now - this.drawMs) / 8;
    this.listeners.onCamera(this.camera);
    if (this.undrawn && picture) this.listeners.onDrawn(picture.frame);
    this.undrawn = false;
    if (moves || grows || fades) this.draw();
  }

  private follow(): void {
    const { drawn } = this.motion;
    const k = this.followed;
    if (k === null || k >= drawn.x.length) return;
    this.untouched = false;
    this.camera = { ...this.camera, x: drawn.x[k]!, y: drawn.y[k]! };
  }

  private place(): void {
    const { x, y, scale } = this.camera;
    const { width, height } = this.size;
    this.world.scale.set(scale / 1000, -scale / 1000);
    this.world.position.set(width / 2 - x * scale, height / 2 + y * scale);
  }
}
