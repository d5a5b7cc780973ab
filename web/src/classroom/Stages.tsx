/** All stages as tiles. */

import { type ReactNode, useEffect, useRef, useState } from "react";
import type { MatView, PupilRow, ClassWall, WallAnswer, WallWorld } from "../generated/classroom";
import { inLanguage, useTexts } from "../i18n";
import { ClassStream } from "./ask";
import { Avatar } from "./Avatar";
import { columnsFor, decodeWall, Tiles } from "./drawing";
import { endAll, listen, watchSize } from "../ui/areas";
import { type CanvasProps, WorldCanvas } from "./WorldCanvas";
import css from "./class.module.css";

interface TileProps extends Omit<CanvasProps, "className"> {
  /** Its own page. */
  href: string;
  state?: string;
  children: ReactNode;
}

/** A world that leads to its own page, and what stands below it. */
function Tile({ href, state, children, ...canvas }: TileProps) {
  return (
    <li className={css.tile} data-state={state} data-world={canvas.world.pupil}>
      <a href={href}>
        <WorldCanvas {...canvas} className={css.world} />
        <span className={css.tileName}>{children}</span>
      </a>
    </li>
  );
}

function PupilTile({ world, pupil, tiles }: { world: WallWorld; pupil: PupilRow; tiles: Tiles }) {
  const t = useTexts("class");
  const state = !pupil.online ? "away" : pupil.hand_s !== null ? "hand" : pupil.stuck_s !== null ? "stuck" : "works";
  return (
    <Tile world={world} tiles={tiles} label={t("stageOf", { name: pupil.name })} href={`/wall?pupil=${encodeURIComponent(pupil.id)}`} state={state}>
      <Avatar name={pupil.avatar} />
      <b>{pupil.name}</b>
      {pupil.goals > 0 && <span>{t("goalsMet", { met: pupil.goals_met, goals: pupil.goals })}</span>}
      {state !== "works" && <span className="warned end">{t(state)}</span>}
    </Tile>
  );
}

const SHARED = "";

/** In how many columns all tiles fit at the largest, while the page's size changes. */
function useColumns(tiles: number): { list: React.RefObject<HTMLUListElement | null>; columns: number } {
  const list = useRef<HTMLUListElement>(null);
  const [columns, setColumns] = useState(1);
  const isThere = tiles > 0;
  useEffect(() => {
    const measure = () => {
      const element = list.current;
      if (element) setColumns(columnsFor(tiles, element.clientWidth, innerHeight - element.getBoundingClientRect().top - scrollY));
    };
    measure();
    return endAll(listen(window, ["resize"], measure), list.current ? watchSize(list.current, measure) : () => undefined);
  }, [tiles, isThere]);
  return { list, columns };
}

/** All stages, the shared mat first; `pupils` are those of the class, in the order in which they joined. */
export function AllStages({ pupils, mat }: { pupils: readonly PupilRow[]; mat: MatView }) {
  const t = useTexts("class");
  const [wall, setWall] = useState<ClassWall | null>(null);
  const [tiles] = useState(() => new Tiles());
  /** The worlds whose tiles are on the screen; null until that is known. */
  const seen = useRef<ReadonlySet<string> | null>(null);
  const tell = useRef<(drawn: boolean) => void>(() => undefined);
  useEffect(() => {
    let listed: ClassWall | null = null;
    tell.current = (drawn) => {
      const places = listed && seen.current && [...listed.worlds.keys()].filter((place) => seen.current!.has(listed!.worlds[place]!.pupil));
      stream.send({ drawn, number: listed?.number ?? 0, seen: places });
    };
    const stream = new ClassStream<WallAnswer>("/api/teacher/wall", {
      onAnswer: (answer) => {
        if (answer.is !== "wall") return;
        listed = answer;
        tiles.forget();
        setWall(answer);
      },
      onBytes: (bytes) => {
        const picture = decodeWall(bytes);
        if (picture?.number === listed?.number)
          picture?.worlds.forEach((cars, place) => tiles.show(listed!.worlds[place]?.pupil ?? SHARED, cars));
        // The answer says that there is time for the next picture.
        requestAnimationFrame(() => tell.current(true));
      },
    });
    return () => stream.close();
  }, [tiles]);
  const byId = new Map(pupils.map((pupil) => [pupil.id, pupil]));
  const shared = wall?.worlds.find((world) => world.pupil === SHARED);
  const shown = (wall?.worlds ?? []).filter((world) => byId.has(world.pupil));
  const { list, columns } = useColumns(shown.length + (shared ? 1 : 0));
  const key = shown.map(({ pupil }) => pupil).join() + String(shared !== undefined);
  useEffect(() => {
    const inView = new Set<string>();
    const observer = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        const world = (target as HTMLElement).dataset.world ?? "";
        if (isIntersecting) inView.add(world);
        else inView.delete(world);
      }
      seen.current = inView;
      tell.current(false);
    });
    for (const tile of list.current?.children ?? []) observer.observe(tile);
    return () => observer.disconnect();
  }, [key, list]);
  if (wall && shown.length === 0 && !shared) return <p className="caution">{t("wallEmpty")}</p>;
  return (
    <ul ref={list} className={css.tiles} style={{ "--columns": columns } as React.CSSProperties}>
      {shared && (
        <Tile world={shared} tiles={tiles} label={t("matTitle")} href="/mat">
          <b>{t("matTitle")}</b>
          <span>{inLanguage(mat.title)}</span>
        </Tile>
      )}
      {shown.map((world) => (
        <PupilTile key={world.pupil} world={world} pupil={byId.get(world.pupil)!} tiles={tiles} />
      ))}
    </ul>
  );
}
