import { lazy, Suspense } from "react";
import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { CompiledWord, MatDocument } from "../api/types";
import { Fence, reload } from "./Fence";
import { useStudio, type Studio } from "./store";

const NO_WORDS: readonly CompiledWord[] = [];
const change = (mat: MatDocument, rangeMm: number | null) => useStudio.setState({ mat, rangeMm });
const tellRunning = (running: Studio["running"]) => useStudio.setState({ running });

const MatPanel = lazy(async () => ({ default: (await import("../mat/MatPanel")).MatPanel }));

/** The mat, fetched after the rest of the page. */
export function Mat() {
  const { t } = useTranslation();
  const compiled = useStudio((studio) => studio.compiled);
  const mat = useStudio((studio) => studio.mat);
  const rangeMm = useStudio((studio) => studio.rangeMm);
  const profile = useStudio((studio) => studio.profile);
  const failed = (
    <div className="failed" role="alert">
      <p>{t("app.failed")}</p>
      <Button className="button primary" onPress={reload}>
        {t("app.reload")}
      </Button>
    </div>
  );
  return (
    <section className="mat-area panel" data-view="mat" id="mat" tabIndex={-1} aria-label={t("mat.title")}>
      <Fence fallback={failed}>
        <Suspense fallback={<p className="quiet loading">{t("app.loading")}</p>}>
          <MatPanel
            image={compiled?.image ?? null}
            words={compiled?.words ?? NO_WORDS}
            mat={mat}
            rangeMm={rangeMm}
            onChange={change}
            profile={profile}
            onRunning={tellRunning}
          />
        </Suspense>
      </Fence>
    </section>
  );
}
