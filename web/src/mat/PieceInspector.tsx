import { ListBox, ListBoxItem } from "react-aria-components";
import { PieceStop } from "../certainty/StopTools";
import { useTexts } from "../i18n";
import { useStudio } from "../state/studio";
import { carsOf } from "./cars";
import { handlesOf, pieceOf, type PieceId, piecesOf, type Voice, without } from "./document";
import { canGrow, canLose, changed, reshaped, retimed, withoutPoint, withPointAfter } from "./edits";
import { Quantity, ToolButton, ToolSwitch } from "../ui/fields";
import { RoadInspector } from "./RoadTools";
import { choose, chosenPiece, editMat, useMat } from "./store";
import fields from "../ui/fields.module.css";
import { classes } from "../ui/classes";

const MOST_POINTS = 24;

/** All furniture by name, and the chosen piece's points as numbers, for use by keyboard. */
export function PieceInspector() {
  const t = useTexts();
  const mat = useStudio(({ mat }) => mat);
  const piece = useMat(chosenPiece);
  const cars = carsOf(mat);
  const all = piecesOf(mat).map(({ id }) => id);
  if (all.length === 0) return <p className="quiet">{t("mat.onlyCars", { count: cars.leaders + cars.followers })}</p>;
  const key = ({ kind, place }: PieceId) => `${kind} ${place}`;
  return (
    <>
      <ListBox
        className={fields.things}
        aria-label={t("mat.furniture")}
        selectionMode="single"
        selectedKeys={piece ? [key(piece)] : []}
        onSelectionChange={(keys) => {
          const wanted = keys === "all" ? undefined : all.find((each) => keys.has(key(each)));
          choose(wanted ? { piece: wanted } : null);
        }}
      >
        {all.map((each) => (
          <ListBoxItem key={key(each)} id={key(each)} className="pick">
            {`${t(`mat.things.${each.kind}`)} ${each.place + 1}`}
          </ListBoxItem>
        ))}
      </ListBox>
      {piece?.kind === "line" && <RoadInspector id={piece} />}
      {piece && <PieceStop piece={piece} />}
      {piece && <Points id={piece} />}
    </>
  );
}

function Points({ id }: { id: PieceId }) {
  const t = useTexts();
  const mat = useStudio(({ mat }) => mat);
  const piece = pieceOf(mat, id);
  if (!piece) return null;
  const points = handlesOf(piece);
  const person = "path" in piece ? piece : null;
  return (
    <div className={classes("stack", fields.points)}>
      {person && (
        <ToolSwitch
          label={t("mat.repeats")}
          isSelected={person.repeats ?? false}
          onChange={(repeats) => editMat(changed(mat, id, { repeats }))}
        />
      )}
      {points.slice(0, MOST_POINTS).map(([x, y], handle) => (
        <div key={handle} className="wrap" role="group" aria-label={t("mat.point", { number: handle + 1 })}>
          <b aria-hidden="true">{handle + 1}</b>
          {person && (
            <Quantity
              label={t("mat.pointTime")}
              value={person.path[handle]![0]}
              step={0.1}
              // A path begins at 0 s.
              isDisabled={handle === 0}
              onChange={(to) => editMat(retimed(mat, id, handle, to))}
            />
          )}
          <Quantity label={t("mat.pointX")} value={x} onChange={(to) => editMat(reshaped(mat, id, handle, [to, y]))} />
          <Quantity label={t("mat.pointY")} value={y} onChange={(to) => editMat(reshaped(mat, id, handle, [x, to]))} />
          {canGrow(id) && (
            <>
              <ToolButton
                icon="plus"
                label={t("mat.addPoint", { number: handle + 1 })}
                onPress={() => editMat(withPointAfter(mat, id, handle))}
              />
              <ToolButton
                icon="minus"
                label={t("mat.removePoint", { number: handle + 1 })}
                isDisabled={!canLose(id, points.length)}
                onPress={() => editMat(withoutPoint(mat, id, handle))}
              />
            </>
          )}
        </div>
      ))}
    </div>
  );
}

const WORDS = ["stop", "go"] as const;
const LATER_S = 2;
const HEARD_M = 1;
const SMALLEST_M = 0.01;

/** The mat's voices: the word of each, its time, and the area in which cars hear it. */
export function Voices() {
  const t = useTexts();
  const mat = useStudio(({ mat }) => mat);
  const voices = mat.voice ?? [];
  const change = (voice: readonly Voice[]) => editMat(voice.length ? { ...mat, voice } : without(mat, "voice"));
  const add = () => {
    const last = voices.at(-1);
    change([...voices, { at_s: last ? last.at_s + LATER_S : LATER_S, word: last?.word === "stop" ? "go" : "stop" }]);
  };
  return (
    <section className="stack" aria-labelledby="mat-voices">
      <h3 id="mat-voices">{t("mat.voices")}</h3>
      {voices.length === 0 && <p className="quiet">{t("mat.noVoices")}</p>}
      {voices.map((voice, place) => (
        <OneVoice
          key={place}
          number={place + 1}
          voice={voice}
          middle={mat.size_m ? [mat.size_m[0] / 2, mat.size_m[1] / 2] : [0, 0]}
          onChange={(voice) => change(voices.with(place, voice))}
          onRemove={() => change(voices.toSpliced(place, 1))}
        />
      ))}
      <ToolButton icon="plus" label={t("mat.addVoice")} wide onPress={add} />
    </section>
  );
}

interface OneVoiceProps {
  number: number;
  voice: Voice;
  middle: readonly [number, number];
  onChange: (voice: Voice) => void;
  onRemove: () => void;
}

function OneVoice({ number, voice, middle, onChange, onRemove }: OneVoiceProps) {
  const t = useTexts();
  const { at_s, word, centre_m, radius_m } = voice;
  const everywhere = centre_m === undefined;
  const toggle = (on: boolean) =>
    onChange(on ? without(voice, "centre_m", "radius_m") : { ...voice, centre_m: middle, radius_m: HEARD_M });
  return (
    <div className={classes("wrap", fields.points)} role="group" aria-label={t("mat.voice", { number })}>
      {WORDS.map((each) => (
        <ToolButton
          key={each}
          icon={each}
          label={t(`mat.${each}`)}
          wide
          aria-pressed={each === word}
          onPress={() => onChange({ ...voice, word: each })}
        />
      ))}
      <Quantity label={t("mat.pointTime")} value={at_s} step={0.1} least={0} onChange={(to) => onChange({ ...voice, at_s: to })} />
      <ToolSwitch label={t("mat.everywhere")} isSelected={everywhere} onChange={toggle} />
      {centre_m && radius_m !== undefined && (
        <>
          <Quantity label={t("mat.pointX")} value={centre_m[0]} onChange={(x) => onChange({ ...voice, centre_m: [x, centre_m[1]] })} />
          <Quantity label={t("mat.pointY")} value={centre_m[1]} onChange={(y) => onChange({ ...voice, centre_m: [centre_m[0], y] })} />
          <Quantity label={t("mat.voiceRadius")} value={radius_m} least={SMALLEST_M} most={2000} onChange={(to) => onChange({ ...voice, radius_m: to })} />
        </>
      )}
      <ToolButton icon="trash" label={t("mat.removeVoice", { number })} onPress={onRemove} />
    </div>
  );
}
