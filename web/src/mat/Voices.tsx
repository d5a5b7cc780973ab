import { useTranslation } from "react-i18next";
import { type Voice, without } from "./document";
import { Quantity } from "./Quantity";
import { editMat, endEdit, useMat } from "./store";
import { ToolButton, ToolSwitch } from "./ToolButton";

const WORDS = ["stop", "go"] as const;
const LATER_S = 2;
const HEARD_M = 1;
const SMALLEST_M = 0.01;

/** What is said on the mat of itself: which word, when, and where it is heard. */
export function Voices() {
  const { t } = useTranslation();
  const mat = useMat((now) => now.mat);
  const voices = mat.voice ?? [];
  const change = (voice: readonly Voice[]) => {
    editMat(voice.length ? { ...mat, voice } : without(mat, "voice"));
    endEdit();
  };
  const add = () => {
    const last = voices.at(-1);
    change([...voices, { at_s: last ? last.at_s + LATER_S : LATER_S, word: last?.word === "stop" ? "go" : "stop" }]);
  };
  return (
    <section aria-labelledby="mat-voices">
      <h3 id="mat-voices">{t("mat.voices")}</h3>
      {voices.length === 0 && <p className="mat-quiet">{t("mat.noVoices")}</p>}
      {voices.map((voice, place) => (
        <OneVoice
          key={place}
          number={place + 1}
          voice={voice}
          middle={mat.size_m ? [mat.size_m[0] / 2, mat.size_m[1] / 2] : [0, 0]}
          onChange={(changed) => change(voices.with(place, changed))}
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
  const { t } = useTranslation();
  const { at_s, word, centre_m, radius_m } = voice;
  const everywhere = centre_m === undefined;
  const toggle = (on: boolean) =>
    onChange(on ? without(voice, "centre_m", "radius_m") : { ...voice, centre_m: middle, radius_m: HEARD_M });
  return (
    <div className="mat-row mat-voice" role="group" aria-label={t("mat.voice", { number })}>
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
