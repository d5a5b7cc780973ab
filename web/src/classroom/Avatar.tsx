/** The pictures of cars that pupils choose from; their ids are `AVATARS` of motorcade/classroom/messages.py. */

import css from "./class.module.css";

interface Look {
  colour: string;
  /** The body above the wheels, in a box of 48 by 32; the ground is at y = 28. */
  body: string;
  window: string;
  /** What makes it what it is, over the body. */
  mark?: string;
  markColour?: string;
  wheels: readonly number[];
}

const LOOKS: Record<string, Look> = {
  bus: { colour: "#d1382f", body: "M3 7h40l2 8v10H3z", window: "M6 10h7v6H6zM16 10h7v6h-7zM26 10h7v6h-7zM36 10h5l1 6h-6z", wheels: [12, 36] },
  digger: {
    colour: "#f2a900", body: "M4 15h10V8h10v7h6v9H4z",
    window: "M16 10h6v5h-6z", mark: "m28 16 10-10 7 9-4 6-2-1 2-5-4-5-7 8z", markColour: "#b97a00", wheels: [9, 25],
  },
  "fire-engine": {
    colour: "#c9241c", body: "M3 11h28V8h9l5 8v9H3z",
    window: "M33 10h6l3 6h-9z", mark: "M3 7h26v2H3zM7 4v4M13 4v4M19 4v4M25 4v4", markColour: "#e8e8e8", wheels: [12, 36],
  },
  lorry: { colour: "#2f7d4f", body: "M2 6h27v19H2zM31 11h8l6 7v7H31z", window: "M33 13h5l4 5h-9z", wheels: [9, 22, 38] },
  "police-car": {
    colour: "#24569e", body: "M3 17l8-2 5-7h14l6 7 9 3v7H3z",
    window: "M14 15l4-5h5v5zM25 10h4l4 5h-8z", mark: "M20 5h7v3h-7z", markColour: "#39a0ff", wheels: [12, 36],
  },
  "racing-car": {
    colour: "#e0481f", body: "M2 19h12l5-6h10l4 5h12v5H2z",
    window: "M20 14h7l2 4h-10z", mark: "M2 11h3v8H2zM40 17h6v2h-6z", markColour: "#7d2a12", wheels: [10, 37],
  },
  rocket: {
    colour: "#7b4bd0", body: "M6 13h24q11 0 15 6-4 6-15 6H6z",
    window: "M28 15a4 4 0 1 1 0 8 4 4 0 0 1 0-8z", mark: "M6 13 2 8h9l5 5zM2 17H0v4h2z", markColour: "#f2a900", wheels: [14, 33],
  },
  snowplough: {
    colour: "#e07b00", body: "M4 14h12V7h13l3 8h5v10H4z",
    window: "M18 9h9l2 6H18z", mark: "M38 13q8 5 8 14h-5q0-8-3-11z", markColour: "#46607a", wheels: [12, 31],
  },
  "sports-car": { colour: "#d62b62", body: "M2 20q3-4 11-5l6-5h12l7 6 8 3v6H2z", window: "M17 15l4-4h8l5 4z", wheels: [12, 37] },
  "tank-wagon": { colour: "#5d6f83", body: "M5 9h22q4 0 4 7t-4 7H5q-4 0-4-7t4-7zM33 12h6l6 6v7H33z", window: "M35 14h3l4 4h-7z", wheels: [9, 23, 39] },
  taxi: {
    colour: "#f0b400", body: "M3 17l8-2 5-7h14l6 7 9 3v7H3z",
    window: "M14 15l4-5h5v5zM25 10h4l4 5h-8z", mark: "M19 4h9v4h-9zM4 20h40v2H4z", markColour: "#1f2328", wheels: [12, 36],
  },
  tractor: { colour: "#3c8c2e", body: "M8 6h14v9h20v9H8z", window: "M11 8h9v7h-9z", mark: "M36 8h3v7h-3z", markColour: "#3a3f45", wheels: [14, 37] },
  train: {
    colour: "#1f6fb5", body: "M4 6h14v9h22q5 0 5 5v5H4z",
    window: "M7 9h8v6H7z", mark: "M33 6h5v9h-5zM31 4h9v3h-9z", markColour: "#123f68", wheels: [10, 23, 36],
  },
  tram: {
    colour: "#c4483a", body: "M4 9h40v16H4z",
    window: "M7 12h8v6H7zM18 12h12v6H18zM33 12h8v6h-8z", mark: "M23 9l-4-6h10l-4 6zM15 2h18v1H15z", markColour: "#6b7480", wheels: [12, 24, 36],
  },
  van: { colour: "#188a8d", body: "M3 7h26l8 8 7 3v7H3z", window: "M23 9h5l6 6H23z", wheels: [12, 36] },
  beetle: { colour: "#5aa02c", body: "M3 21q1-5 8-6 4-8 13-8t13 8q7 1 8 6v4H3z", window: "M15 15q3-5 8-5v5zM25 10q5 0 8 5h-8z", wheels: [12, 36] },
};

/** A pupil's car; the name of the pupil stands beside it, so it says nothing to a screen reader. */
export function Avatar({ name }: { name: string }) {
  const look = LOOKS[name] ?? LOOKS.beetle!;
  return (
    <svg className={css.avatar} viewBox="0 0 48 32" aria-hidden="true">
      <path d={look.body} fill={look.colour} stroke="#0003" strokeWidth="1" />
      <path d={look.window} fill="#d9f1ff" />
      {look.mark && <path d={look.mark} fill={look.markColour} stroke={look.markColour} strokeWidth="1" />}
      {look.wheels.map((x) => (
        <g key={x}>
          <circle cx={x} cy="25" r="4.5" fill="#23272d" />
          <circle cx={x} cy="25" r="1.8" fill="#c9ced6" />
        </g>
      ))}
    </svg>
  );
}
