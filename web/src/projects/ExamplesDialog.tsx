import { useEffect, useState } from "react";
import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import * as api from "../api/http";
import type { Example } from "../api/types";
import { Sheet } from "../app/controls";
import { inLanguage } from "../i18n";
import { attempt } from "./actions";
import { replaceBy } from "./opening";

/** Programs to begin with. */
export function ExamplesDialog({ onClose }: { onClose: () => void }) {
  const { t } = useTranslation();
  const [examples, setExamples] = useState<Example[]>([]);
  useEffect(() => void attempt(async () => setExamples(await api.examples())), []);
  const take = (example: Example) =>
    attempt(async () => {
      const project = await api.example(example.id);
      onClose();
      await replaceBy({ ...project, name: inLanguage(example.title) });
    });
  return (
    <Sheet title={t("examples.title")} onClose={onClose} wide>
      <p className="quiet">{t("examples.about")}</p>
      <ul className="examples">
        {examples.map((example) => (
          <li key={example.id}>
            <Button className="example" onPress={() => void take(example)}>
              <b>{inLanguage(example.title)}</b>
              <span>{inLanguage(example.about)}</span>
            </Button>
          </li>
        ))}
      </ul>
    </Sheet>
  );
}
