import { Input, Label, ListBox, ListBoxItem, NumberField } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { FURNITURE, handlesOf, listOf, pieceOf, type PieceId, type Point, reshaped } from "./document";
import { choose, editMat, endEdit, useMat } from "./store";

const MOST_POINTS = 12;

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
  const change = (handle: number, point: Point) => {
    editMat(reshaped(mat, id, handle, point));
    endEdit();
  };
  return (
    <div className="mat-points">
      {handlesOf(id.kind, piece)
        .slice(0, MOST_POINTS)
        .map(([x, y], handle) => (
          <div key={handle} className="mat-row">
            <Metres label={t("mat.pointX", { number: handle + 1 })} value={x} onChange={(to) => change(handle, [to, y])} />
            <Metres label={t("mat.pointY", { number: handle + 1 })} value={y} onChange={(to) => change(handle, [x, to])} />
          </div>
        ))}
    </div>
  );
}

function Metres({ label, value, onChange }: { label: string; value: number; onChange: (value: number) => void }) {
  return (
    <NumberField
      className="mat-field beside"
      value={value}
      step={0.01}
      minValue={-2000}
      maxValue={2000}
      formatOptions={{ maximumFractionDigits: 3 }}
      onChange={(typed) => !Number.isNaN(typed) && onChange(typed)}
    >
      <Label>{label}</Label>
      <Input />
    </NumberField>
  );
}
