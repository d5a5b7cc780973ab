import { ListBox, ListBoxItem } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { FURNITURE, handlesOf, listOf, type Mat, type Person, pieceOf, type PieceId, reshaped } from "./document";
import { canGrow, canLose, retimed, withoutPoint, withPointAfter, withRepeats } from "./paths";
import { Quantity } from "./Quantity";
import { choose, editMat, endEdit, useMat } from "./store";
import { ToolButton, ToolSwitch } from "./ToolButton";

const MOST_POINTS = 24;

/** All furniture by name, and the chosen piece's points as numbers: what pointers do, keys do here. */
export function PieceInspector() {
  const { t } = useTranslation();
  const mat = useMat((now) => now.mat);
  const chosen = useMat((now) => now.chosen);
  const piece = chosen && "piece" in chosen ? chosen.piece : null;
  const all = FURNITURE.flatMap((kind) => listOf(mat, kind).map((_, place): PieceId => ({ kind, place })));
  if (all.length === 0) return <p className="mat-quiet">{t("mat.noFurniture")}</p>;
  const key = ({ kind, place }: PieceId) => `${kind} ${place}`;
  return (
    <>
      <ListBox
        className="mat-things"
        aria-label={t("mat.furniture")}
        selectionMode="single"
        selectedKeys={piece ? [key(piece)] : []}
        onSelectionChange={(keys) => {
          const wanted = keys === "all" ? undefined : all.find((each) => keys.has(key(each)));
          choose(wanted ? { piece: wanted } : null);
        }}
      >
        {all.map((each) => (
          <ListBoxItem key={key(each)} id={key(each)} className="mat-thing">
            {t(`mat.things.${each.kind}`)} {each.place + 1}
          </ListBoxItem>
        ))}
      </ListBox>
      {piece && <Points id={piece} />}
    </>
  );
}

function Points({ id }: { id: PieceId }) {
  const { t } = useTranslation();
  const mat = useMat((now) => now.mat);
  const piece = pieceOf(mat, id);
  if (!piece) return null;
  const points = handlesOf(id.kind, piece);
  const path = id.kind === "person" ? (piece as Person).path : null;
  return (
    <div className="mat-points">
      {path && (
        <ToolSwitch
          label={t("mat.repeats")}
          isSelected={(piece as Person).repeats ?? false}
          onChange={(on) => change(withRepeats(mat, id, on))}
        />
      )}
      {points.slice(0, MOST_POINTS).map(([x, y], handle) => (
        <div key={handle} className="mat-row" role="group" aria-label={t("mat.point", { number: handle + 1 })}>
          <b aria-hidden="true">{handle + 1}</b>
          {path && (
            <Quantity
              label={t("mat.pointTime")}
              value={path[handle]![0]}
              step={0.1}
              // A path begins at 0 s.
              isDisabled={handle === 0}
              onChange={(to) => change(retimed(mat, id, handle, to))}
            />
          )}
          <Quantity label={t("mat.pointX")} value={x} onChange={(to) => change(reshaped(mat, id, handle, [to, y]))} />
          <Quantity label={t("mat.pointY")} value={y} onChange={(to) => change(reshaped(mat, id, handle, [x, to]))} />
          {canGrow(id) && (
            <>
              <ToolButton
                icon="plus"
                label={t("mat.addPoint", { number: handle + 1 })}
                onPress={() => change(withPointAfter(mat, id, handle))}
              />
              <ToolButton
                icon="minus"
                label={t("mat.removePoint", { number: handle + 1 })}
                isDisabled={!canLose(id, points.length)}
                onPress={() => change(withoutPoint(mat, id, handle))}
              />
            </>
          )}
        </div>
      ))}
    </div>
  );
}

function change(mat: Mat): void {
  editMat(mat);
  endEdit();
}
