import { useState } from "react";
import { Input, Label, TextField } from "react-aria-components";
import { RefusedError, request } from "../api/service";
import type { CarFigures } from "../generated/messages";
import { inLanguage, useTexts } from "../i18n";
import { attempt } from "../projects/actions";
import { chooseKind } from "../projects/project";
import { useAnswer } from "../projects/useAnswer";
import { closeDialog } from "../state/dialogs";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { Sheet, TextButton } from "../ui/controls";
import { download } from "../ui/files";
import { Form, Problem } from "../ui/page";
import controls from "../ui/controls.module.css";
import { OneCar } from "./UploadDialog";

/** What is typed of a move: how far ahead and how far to the left, or by how much it has turned. */
interface Typed {
  first: string;
  left: string;
}
const NOTHING: Typed = { first: "", left: "" };

/** Measure a car: send each move to it, ask what a ruler shows, and let simulated cars drive as it does. */
export function CalibrationDialog() {
  const t = useTexts();
  const profile = useStudio((studio) => studio.profile);
  const [moves] = useAnswer("calibration/moves", [], { profile });
  const [at, setAt] = useState(0);
  const [typed, setTyped] = useState<Record<string, Typed>>({});
  const [figures, setFigures] = useState<CarFigures | null>(null);
  const [problem, setProblem] = useState("");
  const move = moves[at];

  const goOn = () =>
    attempt(async () => {
      setProblem("");
      const asked = moves.slice(0, at + 1).map(({ key }) => [key, typed[key] ?? NOTHING] as const);
      const readings = Object.fromEntries(asked.map(([key, { first, left }]) => [key, `${first} ${left}`]));
      try {
        const found = await request("calibration/fit", { readings, profile });
        if (found.car) setFigures(found);
        else setAt(at + 1);
      } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        setProblem(inLanguage(error.sentence));
      }
    });

  if (figures) return <Measured figures={figures} onBack={() => setFigures(null)} />;
  const now = (move && typed[move.key]) ?? NOTHING;
  const type = (part: Partial<Typed>) => move && setTyped({ ...typed, [move.key]: { ...now, ...part } });
  return (
    <Sheet title={t("calibration.title")}>
      {move && (
        <>
          <p>{t("calibration.about")}</p>
          <h3>{t("calibration.move", { number: at + 1, count: moves.length, move: inLanguage(move.title) })}</h3>
          <OneCar key={move.key} image={move.image} brief />
          <Form id="readings" className="row" onSubmit={() => void goOn()}>
            <Reading
              key={move.key}
              label={t(move.turns ? "calibration.turned" : "calibration.ahead")}
              value={now.first}
              onChange={(first) => type({ first })}
            />
            {!move.turns && <Reading label={t("calibration.left")} value={now.left} onChange={(left) => type({ left })} />}
          </Form>
          <Problem text={problem} />
          <footer className={controls.sheetFoot}>
            <TextButton isDisabled={at === 0} onPress={() => setAt(at - 1)}>{t("calibration.back")}</TextButton>
            <TextButton primary type="submit" form="readings" isDisabled={!now.first.trim()}>{t("calibration.next")}</TextButton>
          </footer>
        </>
      )}
    </Sheet>
  );
}

function Reading({ label, value, onChange }: { label: string; value: string; onChange: (value: string) => void }) {
  return (
    <TextField value={value} onChange={onChange}>
      <Label>{label}</Label>
      <Input inputMode="decimal" maxLength={20} size={8} />
    </TextField>
  );
}

/** What was measured, and what to do with it. */
function Measured({ figures: { told, car, text }, onBack }: { figures: CarFigures; onBack: () => void }) {
  const t = useTexts();
  const inMission = useStudio(({ mission }) => mission !== null);
  const drive = () => {
    useSettings.setState({ ownCar: car });
    chooseKind(useStudio.getState().profile, car);
    closeDialog();
  };
  return (
    <Sheet title={t("calibration.measured")}>
      <ul>
        {told.map((sentence) => (
          <li key={sentence.en}>{inLanguage(sentence)}</li>
        ))}
      </ul>
      <footer className={controls.sheetFoot}>
        <TextButton onPress={onBack}>{t("calibration.back")}</TextButton>
        <TextButton onPress={() => download("my_car.toml", text, "application/toml")}>{t("calibration.download")}</TextButton>
        <TextButton primary isDisabled={inMission} onPress={drive}>{t("calibration.use")}</TextButton>
      </footer>
    </Sheet>
  );
}
