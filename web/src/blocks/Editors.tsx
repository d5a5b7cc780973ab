import { useTranslation } from "react-i18next";
import { confirmed } from "../app/asking";
import { Check } from "../app/controls";
import { Divider } from "../app/Divider";
import { tell } from "../app/telling";
import { useSettings } from "../app/settings";
import { useStudio } from "../app/store";
import { flush } from "../words/compiling";
import { EditorPane } from "./EditorPane";
import { emptyState, workspaceOf } from "./workspaces";

function addFollowers(): void {
  const { followers, parkedFollowers } = useStudio.getState();
  if (followers === null) {
    useStudio.setState({ followers: parkedFollowers ?? emptyState("followers"), parkedFollowers: null });
  }
}

/** The leader's editor and, where the user wants one, the followers' beside it. */
export function Editors() {
  const { t } = useTranslation();
  const followed = useStudio((studio) => studio.followers !== null);
  const share = useSettings((settings) => settings.shares.editors);

  const dropFollowers = async () => {
    flush();
    const hasSteps = (workspaceOf("followers")?.getAllBlocks(false).length ?? 0) > 1;
    const agreed =
      !hasSteps ||
      (await confirmed({ title: t("editors.dropTitle"), text: t("editors.dropText"), yes: t("editors.dropYes") }));
    if (!agreed) return;
    useStudio.setState(({ followers }) => ({ parkedFollowers: followers, followers: null }));
    if (hasSteps) tell(t("editors.dropped"), "info", { label: t("editors.bringBack"), run: addFollowers });
  };

  return (
    <div className="editors" style={{ "--share": followed ? share : 1 } as React.CSSProperties} data-followed={followed}>
      <EditorPane editor="leader">
        <Check
          id="program-followers"
          checked={followed}
          onChange={(wanted) => (wanted ? addFollowers() : void dropFollowers())}
        >
          {t("editors.programFollowers")}
        </Check>
      </EditorPane>
      {followed && (
        <>
          <Divider
            label={t("editors.divider")}
            share={share}
            orientation="vertical"
            onShare={(editors) => useSettings.setState(({ shares }) => ({ shares: { ...shares, editors } }))}
          />
          <EditorPane editor="followers" />
        </>
      )}
    </div>
  );
}
