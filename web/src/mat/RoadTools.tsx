import { useTexts } from "../i18n";
import { useStudio } from "../state/studio";
import { putConvoy, turnRoad } from "./actions";
import { MOST_ONE_BY_ONE } from "./cars";
import { type Line, type PieceId, pieceOf } from "./document";
import { changed } from "./edits";
import { Quantity, ToolButton, ToolSwitch } from "../ui/fields";
import { chosenPiece, drawRoads, editMat, useMat } from "./store";
import { LINE_M } from "./ways";
import css from "./mat.module.css";

/** While roads are drawn: what to do, the way for the cars onto the newest road, and the end of it. */
export function DrawHint() {
  const t = useTexts();
  const drawing = useMat((now) => now.drawing);
  const piece = useMat(chosenPiece);
  if (!drawing) return null;
  return (
    <div className={css.drawHint} role="status">
      <span>{t("mat.drawHint")}</span>
      {piece?.kind === "line" && <PutConvoy id={piece} />}
      <ToolButton icon="done" wide label={t("mat.drawDone")} onPress={() => drawRoads(false)} />
    </div>
  );
}

function PutConvoy({ id }: { id: PieceId }) {
  const t = useTexts();
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  const isPossible = cars > 0 && cars <= MOST_ONE_BY_ONE;
  return <ToolButton icon="leader" wide primary label={t("mat.putConvoy")} isDisabled={!isPossible} onPress={() => putConvoy(id)} />;
}

const LEAST_M = 0.01;
const WIDEST_M = 1;
const LARGEST_M = 2000;

/** What a road has beside its points, and what is done with it. */
export function RoadInspector({ id }: { id: PieceId }) {
  const t = useTexts();
  const mat = useStudio(({ mat }) => mat);
  const line = pieceOf(mat, id) as Line | undefined;
  if (!line) return null;
  const change = (what: Parameters<typeof changed>[2]) => editMat(changed(mat, id, what));
  return (
    <>
      <div className="wrap">
        <PutConvoy id={id} />
        <ToolButton icon="turnLeft" label={t("mat.turnRoad")} onPress={() => turnRoad(id)} />
      </div>
      <div className="wrap">
        <Quantity label={t("mat.lineWidth")} value={line.width_m ?? LINE_M} least={LEAST_M} most={WIDEST_M} onChange={(width_m) => change({ width_m })} />
        <Quantity label={t("mat.lineBend")} value={line.bend_m ?? 0} least={0} most={LARGEST_M} onChange={(bend_m) => change({ bend_m })} />
        <ToolSwitch label={t("mat.lineClosed")} isSelected={line.closed ?? false} onChange={(closed) => change({ closed })} />
      </div>
    </>
  );
}
