import { type KeyboardEvent, memo, useEffect, useRef, useState } from "react";
import { tapZone } from "../certainty/stops";
import { useTexts } from "../i18n";
import { useMission } from "../missions/store";
import { endEdit } from "../state/history";
import { useStudio, useWords } from "../state/studio";
import { endAll } from "../ui/areas";
import { countersText } from "../words/Counters";
import { tapCar, dragTo, drawRoad, duplicateChosen, moveBy, removeChosen, turnCar, turnRoad } from "./actions";
import { type Camera } from "./camera";
import { panned, scaleBar, zoomed } from "./framing";
import { colourWords } from "./colours";
import { piecesOf } from "./document";
import { attachPointers, gripAt, nudgeOf } from "./pointer";
import { chasedCar, choose, type Chosen, chosenCar, chosenPiece, drawRoads, toggleChase, useMat } from "./store";
import { Scene } from "./scene";
import { session } from "./session";
import { ToolButton } from "../ui/fields";
import css from "./mat.module.css";
import { classes } from "../ui/classes";

const PAN_PX = 60;
const ZOOM = 1.25;

/** Copy the stores into the scene, now and whenever they change, and act on its pointers. */
function connect(scene: Scene): () => void {
  const show = () => {
    const { mat, rangeMm } = useStudio.getState();
    const now = useMat.getState();
    const { told, tracks, air, followed, hello } = now;
    scene.setMat(mat, chosenPiece(now));
    scene.choose(chosenCar(now), told, followed);
    scene.show(tracks, air, rangeMm === null ? (hello?.range_m ?? 1) : rangeMm / 1000);
  };
  const { hello } = useMat.getState();
  if (hello) scene.setHello(hello);
  if (session.picture) scene.take(session.picture);
  show();
  const shown = ["chosen", "told", "tracks", "air", "followed", "hello"] as const;
  // Of another project, whose cars the camera shows at once.
  let awaited: "hello" | "picture" | null = null;
  return endAll(
    session.listen((picture, missed) => {
      if (awaited === "picture") {
        awaited = null;
        scene.cut();
      }
      scene.take(picture, missed);
    }),
    useMat.subscribe((now, before) => {
      if (now.hello && now.hello !== before.hello) {
        scene.setHello(now.hello);
        awaited &&= "picture";
      }
      if (shown.some((key) => now[key] !== before[key])) show();
      if (now.decisions !== before.decisions) scene.count(new Map(now.decisions.map((decided) => [decided.car, countersText(decided).join(" · ")])));
    }),
    useStudio.subscribe((now, before) => {
      if (now.generation !== before.generation && now.mat !== before.mat) awaited = "hello";
      if (now.mat !== before.mat || now.rangeMm !== before.rangeMm) show();
    }),
    attachPointers(scene.host, scene, {
      gripAt: (point, reachPx) => {
        const { chosen, tMs } = useMat.getState();
        const radiusM = scene.carPx / scene.camera.scale / 2;
        const sight = { mat: useStudio.getState().mat, chosen, drawn: scene.motion.drawn, radiusM, tMs };
        return gripAt(sight, point, reachPx / scene.camera.scale);
      },
      onChoose: (grip, at) => {
        if (grip && "car" in grip) {
          tapCar(grip.car);
          return;
        }
        choose(grip && { piece: grip.piece });
        tapZone(grip ? null : at, useMission.getState().mission?.zones ?? []);
      },
      onDrag: (grip, to, by) => {
        if (useMat.getState().asked) useMat.setState({ asked: null });
        dragTo(grip, to, by);
      },
      onDrop: endEdit,
      isDrawing: () => useMat.getState().drawing,
      onStroke: drawRoad,
    }),
  );
}

/** Choose the next of all cars and pieces, or the one before. */
function chooseNext(step: 1 | -1): void {
  const { hello, chosen } = useMat.getState();
  const cars = Array.from({ length: hello?.cars ?? 0 }, (_, car) => ({ car }));
  const things = [...cars, ...piecesOf(useStudio.getState().mat).map(({ id }) => ({ piece: id }))];
  const now = things.findIndex((each) => JSON.stringify(each) === JSON.stringify(chosen));
  choose(things.at((now + step + things.length) % things.length) ?? null);
}

/** While the stage is seen from behind a car, these lead to another car. */
const CHASE_KEYS: Record<string, 1 | -1> = { n: 1, p: -1, ArrowRight: 1, ArrowLeft: -1 };

function chaseNext(car: number, step: 1 | -1): void {
  const cars = useMat.getState().hello?.cars ?? 1;
  choose({ car: (car + step + cars) % cars });
}

/** Turn a car a little to the left (1) or to the right (-1), or a road by a right angle. */
function turn(chosen: Chosen, way: 1 | -1): void {
  if (!chosen) return;
  if ("car" in chosen) turnCar(chosen.car, way);
  else if (chosen.piece.kind === "line") turnRoad(chosen.piece);
}

/** Act on a key; false for a key that means nothing here. */
function press(event: KeyboardEvent, scene: Scene): boolean {
  const { chosen } = useMat.getState();
  const command = event.ctrlKey || event.metaKey;
  const nudge = nudgeOf(event);
  const chased = chasedCar(useMat.getState());
  if (chased !== null && !command && event.key in CHASE_KEYS) {
    chaseNext(chased, CHASE_KEYS[event.key]!);
    return true;
  }
  if (nudge && !command) {
    const [x, y] = nudge;
    if (chosen) moveBy(chosen, x, y);
    else scene.look(panned(scene.camera, -Math.sign(x) * PAN_PX, Math.sign(y) * PAN_PX));
    return true;
  }
  if (command) {
    const key = event.key.toLowerCase();
    if (key === "d") duplicateChosen();
    return key === "d";
  }
  const keys: Record<string, () => void> = {
    "+": () => scene.look(zoomed(scene.camera, scene.size, ZOOM)),
    "=": () => scene.look(zoomed(scene.camera, scene.size, ZOOM)),
    "-": () => scene.look(zoomed(scene.camera, scene.size, 1 / ZOOM)),
    "0": () => scene.frame(),
    a: () => scene.showAll(),
    n: () => chooseNext(1),
    p: () => chooseNext(-1),
    Delete: removeChosen,
    Backspace: removeChosen,
    Enter: () => chosen && "car" in chosen && tapCar(chosen.car),
    Escape: () => {
      choose(null);
      drawRoads(false);
    },
    r: () => turn(chosen, -1),
    R: () => turn(chosen, 1),
  };
  const action = keys[event.key];
  action?.();
  // Escape also ends the view of the stage alone.
  return action !== undefined && event.key !== "Escape";
}

export function MatCanvas() {
  const t = useTexts();
  const words = useWords();
  const host = useRef<HTMLDivElement>(null);
  const scene = useMat((now) => now.scene);
  const [camera, setCamera] = useState<Camera | null>(null);
  const [held, setHeld] = useState(false);

  useEffect(() => {
    let scale = 0;
    const created = new Scene(host.current!, {
      onCamera: (now) => {
        // Only where it differs: until it draws the scale bar again, React keeps each update that it is told of.
        if (now.scale !== scale) setCamera(now);
        scale = now.scale;
      },
      onDrawn: (frame) => session.shown(frame),
      onHeld: setHeld,
    });
    useMat.setState({ scene: created });
    return endAll(connect(created), () => created.destroy(), () => useMat.setState({ scene: null }));
  }, []);

  useEffect(() => scene?.setColours(colourWords(words)), [scene, words]);

  const isChased = useMat((now) => chasedCar(now) !== null);
  const bar = camera && !isChased && scaleBar(camera);
  return (
    <div
      className={classes("cover clip", css.canvas)}
      ref={host}
      role="application"
      tabIndex={0}
      aria-label={t("mat.canvas")}
      aria-describedby="mat-keys"
      onKeyDown={(event) => {
        if (event.target !== host.current || !scene || !press(event, scene)) return;
        event.preventDefault();
        event.stopPropagation();
      }}
      onBlur={endEdit}
    >
      <span id="mat-keys" hidden>
        {t("mat.keys")}
      </span>
      {bar && (
        <div className={css.scale} data-part="scale" style={{ width: bar.pixels }} aria-hidden="true">
          {bar.metres >= 1 ? t("mat.metres", { count: bar.metres }) : t("mat.centimetres", { count: Math.round(bar.metres * 100) })}
        </div>
      )}
      <ViewTools scene={scene} held={held} />
    </div>
  );
}

/** The buttons for the view; the scale beside them changes with each picture while the camera moves. */
const ViewTools = memo(function ViewTools({ scene, held }: { scene: Scene | null; held: boolean }) {
  const t = useTexts();
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  const chased = useMat(chasedCar);
  const zoom = (factor: number) => scene?.look(zoomed(scene.camera, scene.size, factor));
  return (
    <div className={css.zoom}>
      {chased === null ? (
        <>
          <ToolButton icon="plus" label={t("mat.zoomIn")} onPress={() => zoom(ZOOM)} />
          <ToolButton icon="minus" label={t("mat.zoomOut")} onPress={() => zoom(1 / ZOOM)} />
          {held && <ToolButton icon="follow" label={t("mat.frame")} onPress={() => scene?.frame()} />}
          <ToolButton icon="chase" label={t("mat.chaseKey")} isDisabled={!cars} onPress={toggleChase} />
        </>
      ) : (
        <>
          <ToolButton icon="mat" label={t("mat.fromAbove")} onPress={toggleChase} />
          <ToolButton icon="left" label={t("mat.previousCar")} onPress={() => chaseNext(chased, -1)} />
          <ToolButton icon="right" label={t("mat.nextCar")} onPress={() => chaseNext(chased, 1)} />
        </>
      )}
    </div>
  );
});
