/** How cars are painted: around the middle, in halves of a car, x to the front. White parts take a car's colour. */

export const DARK = "#1b2330";
const GLASS = "#27364a";

/** A filled rectangle with round corners; its path stays, so that it can be stroked too. */
export function rounded(g: CanvasRenderingContext2D, fill: string | CanvasGradient, box: readonly [number, number, number, number], radius: number | number[]) {
  g.fillStyle = fill;
  g.beginPath();
  g.roundRect(...box, radius);
  g.fill();
}

/** A filled circle; its path stays, so that it can be stroked too. */
export function dot(g: CanvasRenderingContext2D, fill: string, x: number, y: number, radius: number) {
  g.fillStyle = fill;
  g.beginPath();
  g.arc(x, y, radius, 0, 2 * Math.PI);
  g.fill();
}

/** Stroke the path of what was filled. */
export function rim(g: CanvasRenderingContext2D, width: number) {
  g.strokeStyle = DARK;
  g.lineWidth = width;
  g.stroke();
}

const TREAD = 0.5;

/** A wheel from above, 1.2 by 0.44 of a half car, its tread moved by a share of its spacing. */
export function wheel(share: number) {
  return (g: CanvasRenderingContext2D) => {
    rounded(g, DARK, [-1, -0.4, 2, 0.8], 0.26);
    g.save();
    g.beginPath();
    g.roundRect(-1, -0.4, 2, 0.8, 0.26);
    g.clip();
    g.fillStyle = "#76839a";
    for (let x = -1.5 + share * TREAD; x < 1.5; x += TREAD) g.fillRect(x, -0.4, TREAD * 0.34, 0.8);
    g.restore();
  };
}

function eyes(g: CanvasRenderingContext2D, open: boolean) {
  rounded(g, GLASS, [0.1, -0.5, 0.5, 1], 0.22);
  for (const y of [-0.25, 0.25]) {
    g.beginPath();
    if (open) {
      g.fillStyle = "#fff";
      g.ellipse(0.38, y, 0.17, 0.19, 0, 0, 2 * Math.PI);
      g.fill();
      dot(g, "#7a1030", 0.44, y, 0.09);
      dot(g, "#ffb9c9", 0.47, y - 0.03, 0.035);
    } else {
      g.strokeStyle = "#fff";
      g.lineWidth = 0.08;
      g.arc(0.34, y, 0.16, -1.1, 1.1);
      g.stroke();
    }
  }
}

/** The four lamps as they are when off. */
function lamps(g: CanvasRenderingContext2D) {
  for (const [x, y] of LAMPS) {
    dot(g, "#dfe5ee", x, y, 0.1);
    rim(g, 0.05);
  }
}

/** Where the LEDs are, in half cars ahead and to the left. */
export const LAMPS = [
  [0.66, 0.42],
  [0.66, -0.42],
  [-0.68, -0.42],
  [-0.68, 0.42],
] as const;

export function face(open: boolean) {
  return (g: CanvasRenderingContext2D) => {
    eyes(g, open);
    lamps(g);
  };
}

/** Fill all with a light or a shade that fades from a radius on; `stops` has its colours, by their places from there to the rim. */
export function fade(g: CanvasRenderingContext2D, from: number, stops: Record<number, string>) {
  g.fillStyle = stopped(g.createRadialGradient(0, 0, from, 0, 0, 1), stops);
  g.fillRect(-1, -1, 2, 2);
}

function stopped(gradient: CanvasGradient, stops: Record<number, string>): CanvasGradient {
  for (const [at, colour] of Object.entries(stops)) gradient.addColorStop(Number(at), colour);
  return gradient;
}

export const shadow = (g: CanvasRenderingContext2D) => fade(g, 0.5, { 0: "rgba(10,16,30,0.42)", 1: "rgba(10,16,30,0)" });

export function beacon(g: CanvasRenderingContext2D) {
  dot(g, "#fff", 0, 0, 0.9);
  rim(g, 0.14);
  dot(g, "#d62728", 0, 0, 0.55);
  dot(g, "rgba(255,255,255,0.7)", -0.18, -0.18, 0.16);
}

/** White, a little darker to the sides: the tint keeps a rounded look. */
const bodyFill = (g: CanvasRenderingContext2D) =>
  stopped(g.createLinearGradient(0, -0.66, 0, 0.66), { 0: "#cfd3da", 0.28: "#ffffff", 0.72: "#ffffff", 1: "#cfd3da" });

export function follower(g: CanvasRenderingContext2D) {
  rounded(g, bodyFill(g), [-0.92, -0.64, 1.84, 1.28], [0.34, 0.62, 0.62, 0.34]);
  rim(g, 0.09);
}

/** Fill a path, given as in SVG, and stroke its rim. */
function shape(g: CanvasRenderingContext2D, path: string, fill: string | CanvasGradient, width: number, ink = DARK) {
  const outline = new Path2D(path);
  g.fillStyle = fill;
  g.strokeStyle = ink;
  g.lineWidth = width;
  g.fill(outline);
  g.stroke(outline);
}

/** A leader differs from followers by its shape too: a pointed nose, and the star around its beacon. */
export function leader(g: CanvasRenderingContext2D) {
  shape(g, "M1 0C.92.5.7.68.4.68H-.66Q-.94.66-.94.36V-.36Q-.94-.66-.66-.68H.4C.7-.68.92-.5 1 0z", bodyFill(g), 0.1);
  star(g);
}

function star(g: CanvasRenderingContext2D) {
  g.beginPath();
  for (let k = 0; k < 10; k++) {
    const angle = (k * Math.PI) / 5;
    const reach = k % 2 ? 0.225 : 0.5;
    g.lineTo(-0.36 + reach * Math.cos(angle), reach * Math.sin(angle));
  }
  g.closePath();
  g.fillStyle = "#fff";
  g.fill();
  rim(g, 0.07);
}

/** A leader in high contrast: a white shape that takes the colour of a word, and differs without it. */
export const arrow = (g: CanvasRenderingContext2D) => shape(g, "M.98 0-.86.9-.46 0-.86-.9z", "#fff", 0.08, "#fff");

/** A follower there; the wedge in it shows their heading. */
export function ring(g: CanvasRenderingContext2D) {
  dot(g, "#fff", 0, 0, 0.72);
  g.fillStyle = "#000";
  g.fill(new Path2D("M.62 0 .12.36.12-.36z"));
}

/** What the stage draws at a car that lost a message, as paths of SVG. */
export const LOSS_SIGNS = { missed: "M0-.62.62 0 0 .62-.62 0z", collision: "M-.6-.6.6.6M-.6.6.6-.6" } as const;

export type LossSign = keyof typeof LOSS_SIGNS;

export function lossSign(name: LossSign) {
  return (g: CanvasRenderingContext2D) => {
    const path = new Path2D(LOSS_SIGNS[name]);
    for (const [colour, width] of [[DARK, 0.5], ["#fff", 0.28]] as const) {
      g.strokeStyle = colour;
      g.lineWidth = width;
      g.stroke(path);
    }
  };
}
