import buttons from "./buttons.module.css";
/** The page's icons, drawn in the colour of the text around them. */

const PATHS = {
  levels: "M4 20v-5h4v5M10 20V10h4v10M16 20V5h4v15",
  undo: "M9 7 4 12l5 5M4 12h10a6 6 0 0 1 6 6v1",
  redo: "m15 7 5 5-5 5M20 12H10a6 6 0 0 0-6 6v1",
  tidy: "M4 6h16M4 12h10M4 18h13",
  pencil: "m4 20 1-4L16 5l3 3L8 19zM14 7l3 3",
  move: "M12 3v18M3 12h18M9.500 5.500 12 3l2.500 2.500M9.500 18.500 12 21l2.500-2.500M5.500 9.500 3 12l2.500 2.500M18.500 9.500 21 12l-2.500 2.500",
  stretch: "M6 6l12 12M6 11V6h5M18 13v5h-5",
  up: "m6 15 6-6 6 6",
  down: "m6 9 6 6 6-6",
  close: "M6 6l12 12M18 6 6 18",
  file: "M6 3h8l4 4v14H6zM14 3v4h4",
  examples: "M4 4h7v7H4zM13 4h7v7h-7zM4 13h7v7H4zM13 13h7v7h-7z",
  upload: "M12 16V4M7 9l5-5 5 5M4 16v4h16v-4",
  settings: "M4 7h10M18 7h2M4 17h2M10 17h10M16 5v4M8 15v4",
  help: "M9 9.5a3 3 0 1 1 4.5 2.6c-1 .6-1.5 1.2-1.5 2.4M12 18v.1M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18Z",
  warning: "M12 4 2.5 20h19zM12 10v5M12 17.5v.1",
  error: "M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18ZM12 7v6M12 16.5v.1",
  done: "m5 13 4 4L19 7",
  blocks: "M4 6h5l1 2h4l1-2h5v12H4z",
  star: "m12 4 2.4 5.2 5.6.7-4.1 3.9 1.1 5.6L12 16.6l-5 2.8 1.1-5.6L4 9.9l5.6-.7z",
  mat: "M4 4h16v16H4zM12 8l3.5 7h-7z",
  trash: "M5 7h14M10 7V4h4v3M7 7l1 13h8l1-13",
  play: "M7 4.5v15l12-7.5z",
  pause: "M8 5v14M16 5v14",
  step: "M6 5v14l9-7zM18 5v14",
  reset: "M5 5v5h5M5.5 10a7 7 0 1 1-.6 5",
  plus: "M12 5v14M5 12h14",
  minus: "M5 12h14",
  fit: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  shrink: "M9 4v5H4M20 9h-5V4M15 20v-5h5M4 15h5v5",
  follow: "M12 3v4M12 17v4M3 12h4M17 12h4M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8Z",
  leader: "M4 7h10l6 5-6 5H4zM9 9.5l.8 1.6 1.8.2-1.3 1.2.3 1.8L9 13.4l-1.6.9.3-1.8-1.3-1.2 1.8-.2z",
  follower: "M4 8.5A1.5 1.5 0 0 1 5.500 7H15a5 5 0 0 1 0 10H5.500A1.500 1.500 0 0 1 4 15.500zM13 9.500v5",
  wall: "M3 15h18M3 9h18v6M3 9v6M9 9v6M15 9v6",
  disc: "M12 4a8 8 0 1 0 0 16 8 8 0 0 0 0-16Z",
  polygon: "M4 7l16-2-2 13-12 2z",
  spot: "M12 6a6 6 0 1 0 0 12 6 6 0 0 0 0-12ZM12 9a3 3 0 1 0 0 6 3 3 0 0 0 0-6Z",
  patch: "M5 6h14v12H5zM5 12l6-6M5 18 17 6M11 18l8-8",
  straight: "M3 8h18M3 16h18M5 12h4M15 12h4",
  bend: "M3 7h6a8 8 0 0 1 8 8v6M3 15h6v6M3 11h3M13 18v3",
  crossing: "M8 3v5H3M16 3v5h5M8 21v-5H3M16 21v-5h5M12 4v3M12 17v3M4 12h3M17 12h3",
  person: "M12 4a3 3 0 1 0 0 6 3 3 0 0 0 0-6ZM5.500 20a6.500 6.500 0 0 1 13 0",
  copy: "M9 9h11v11H9zM15 9V4H4v11h5",
  left: "m15 5-7 7 7 7",
  right: "m9 5 7 7-7 7",
  turnLeft: "M8 4 4 8l4 4M4 8h9a6 6 0 0 1 0 12H9",
  turnRight: "m16 4 4 4-4 4M20 8h-9a6 6 0 0 0 0 12h4",
  stop: "M8 3h8l5 5v8l-5 5H8l-5-5V8zM9 12h6",
  go: "M4 10v4h3l5 4V6L7 10zM16 9a4 4 0 0 1 0 6M18.500 6.500a8 8 0 0 1 0 11",
  silence: "M4 10v4h3l5 4V6L7 10zM16 10l4 4M20 10l-4 4",
  chase: "M3 20 9 8h6l6 12M12 20v-2M12 14.500v-1.500M12 11v-.500M4 5h16",
  present: "M5 5v14l9-7zM18 5v14",
  hand: "M7 12V6.500a1.500 1.500 0 0 1 3 0V11 4.500a1.500 1.500 0 0 1 3 0V11 6a1.500 1.500 0 0 1 3 0v7c0 4.500-2 7.500-5.500 7.500-3 0-4.500-1.500-6.500-6.500-.800-2 1-3 2-1.500z",
  download: "M12 4v12M7 11l5 5 5-5M4 20h16",
} as const;

export type IconName = keyof typeof PATHS;

export function Icon({ name }: { name: IconName }) {
  return (
    <svg className={buttons.icon} viewBox="0 0 24 24" aria-hidden="true">
      <path d={PATHS[name]} />
    </svg>
  );
}
