/** How fast this browser draws: whether WebGL pays, and how often it can draw without being busy with nothing else. */

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
/** One that waited for other work is tried again, until so much time is gone: the last one needs the rest of 200 ms. */
const LATEST_MS = 100;

/** Programs that draw on the processor, by their names. */
const BY_PROCESSOR = /swiftshader|llvmpipe|softpipe|software|basic render/i;
/** What Chromium and Safari say in place of the name, which Chromium tells on request. */
const MASKED = "WebKit WebGL";

function nameOf(gl: WebGLRenderingContext): string {
  const told = String(gl.getParameter(gl.RENDERER));
  const info = told === MASKED && gl.getExtension("WEBGL_debug_renderer_info");
  return info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : told;
}

/** Whether WebGL is more than a program on the processor. */
export function hasFastWebGl(now = () => performance.now()): boolean {
  const begun = now();
  // A browser that says that it has no graphics processor is right.
  const gl = document.createElement("canvas").getContext("webgl", { failIfMajorPerformanceCaveat: true });
  if (!gl) return false;
  const fast = !BY_PROCESSOR.test(nameOf(gl)) && drawsFast(gl, now, begun + LATEST_MS);
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return fast;
}

/** Measure it: few browsers name the program, and some say otherwise. A program on the processor takes up to 200 ms. */
function drawsFast(gl: WebGLRenderingContext, now: () => number, until: number): boolean {
  gl.canvas.width = gl.canvas.height = SIDE_PX;
  prepare(gl);
  // It waits for the program to be compiled.
  draw(gl, 1);
  let fast = false;
  while (!fast && now() < until) {
    const before = now();
    draw(gl, SIDE_PX);
    fast = now() - before < FAST_MS;
  }
  // A lost context draws nothing, and at once.
  return fast && !gl.isContextLost();
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

/** Draw a square of so many pixels, and wait until it is drawn. */
function draw(gl: WebGLRenderingContext, side: number): void {
  gl.viewport(0, 0, side, side);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  // Only who reads waits for the end of the drawing.
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
}

/** Whoever draws twenty pictures a second and more needs no rest. */
const RESTLESS_MS = 50;

/** Drawings with the screen's pictures. Where one takes long until it is painted, the page rests as long before the next. */
export class Drawings {
  private waiting = false;
  private frame = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private begunAt = 0;
  private tookMs = 0;

  constructor(
    private readonly draw: () => void,
    private readonly now = () => performance.now(),
  ) {}

  /** Ask for a drawing; for one, however often it is asked. */
  request(): void {
    if (this.waiting) return;
    this.waiting = true;
    const restMs = this.tookMs > RESTLESS_MS ? this.begunAt + 2 * this.tookMs - this.now() : 0;
    const next = () => (this.frame = requestAnimationFrame(() => this.drawNow()));
    if (restMs > 0) this.timer = setTimeout(next, restMs);
    else next();
  }

  stop(): void {
    clearTimeout(this.timer);
    cancelAnimationFrame(this.frame);
  }

  private drawNow(): void {
    this.waiting = false;
    const begunAt = (this.begunAt = this.now());
    // A timer is due only when the picture is painted, which may take far longer than to say what is in it.
    setTimeout(() => (this.tookMs = this.now() - begunAt));
    this.draw();
  }
}
