/** How fast this browser draws: whether WebGL pays, and how often the stage is drawn. */

/** Each of its pixels costs far more than one of the stage: a graphics processor needs a few milliseconds at most. */
const SIDE_PX = 512;
const VERTICES = "attribute vec2 at; void main() { gl_Position = vec4(at, 0., 1.); }";
const PIXELS = `precision mediump float;
void main() {
  vec2 v = gl_FragCoord.xy * .01;
  for (int k = 0; k < 32; k++) v = fract(v * v + v.yx + .3);
  gl_FragColor = vec4(v, 0., .5);
}`;
/** The processor needs longer for it. */
const FAST_MS = 12;
/** One measurement that takes longer needs no second one. */
const SLOW_MS = 60;

/** Whether WebGL is more than a program on the processor. It is measured: few browsers say so, and some say otherwise. */
export function hasFastWebGl(): boolean {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIDE_PX;
  const gl = canvas.getContext("webgl");
  if (!gl) return false;
  prepare(gl);
  // The first one waits for the program to be compiled.
  draw(gl, 1);
  const ms = draw(gl, SIDE_PX);
  const fast = ms < FAST_MS || (ms < SLOW_MS && draw(gl, SIDE_PX) < FAST_MS);
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return fast;
}

function prepare(gl: WebGLRenderingContext): void {
  const program = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, VERTICES], [gl.FRAGMENT_SHADER, PIXELS]] as const) {
    const shader = gl.createShader(type)!;
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
  const place = gl.getAttribLocation(program, "at");
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, 2, gl.FLOAT, false, 0, 0);
}

/** The time in milliseconds until a square of so many pixels is drawn. */
function draw(gl: WebGLRenderingContext, side: number): number {
  const begun = performance.now();
  gl.viewport(0, 0, side, side);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  // Only who reads waits for the end of the drawing.
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  return performance.now() - begun;
}

/** A canvas that the processor draws. By itself a browser may choose the same slow way as WebGL's. */
export function plainCanvas(width?: number, height?: number): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  if (width) canvas.width = width;
  if (height) canvas.height = height;
  canvas.getContext("2d", { willReadFrequently: true });
  return canvas;
}

/** Pictures that take longer leave no time for anything else. */
const HEAVY_MS = 50;
/** So many in a row; one alone may have waited for other work. */
const IN_A_ROW = 3;

/**
 * Calls back with the screen's next picture, once for all requests before it; where the browser takes long to show one,
 * it leaves as much time between two for the rest of the page.
 */
export class Pace {
  private latestMs: number[] = [];
  private begunMs = 0;
  private wanted = false;
  private ends: (() => void) | null = null;

  constructor(
    private readonly draw: () => void,
    private readonly now = () => performance.now(),
  ) {}

  /** Ask for a drawing. */
  request(): void {
    this.wanted = true;
    if (!this.ends) this.wait();
  }

  stop(): void {
    this.ends?.();
  }

  private wait(): void {
    const request = requestAnimationFrame(() => this.next());
    this.ends = () => cancelAnimationFrame(request);
  }

  private next(): void {
    this.ends = null;
    const now = this.now();
    const begun = this.begunMs;
    this.begunMs = 0;
    if (begun) this.latestMs = [now - begun, ...this.latestMs].slice(0, IN_A_ROW);
    if (!this.wanted) return;
    const pictureMs = Math.min(...this.latestMs);
    if (begun && this.latestMs.length === IN_A_ROW && pictureMs > HEAVY_MS) {
      const timer = setTimeout(() => this.wait(), pictureMs);
      this.ends = () => clearTimeout(timer);
      return;
    }
    this.wanted = false;
    this.begunMs = now;
    this.draw();
    // How long the browser takes for this picture shows when the next one can be drawn.
    this.wait();
  }
}
