/** Files of tests share one page: each begins with the state that a page has when it is opened. */

import { beforeAll } from "vitest";
import { useSockets } from "./api/connection";
import { useStops } from "./certainty/stops";
import { useTrials } from "./certainty/trials";
import { useMat } from "./mat/store";
import { useDraft } from "./missions/draft";
import { useMission } from "./missions/store";
import { usePair } from "./pair/store";
import { usePupil } from "./pupil/store";
import { usePython } from "./python/text";
import { useRemote } from "./remote/link";
import { useDialogs } from "./state/dialogs";
import { useHistory } from "./state/history";
import { useQuestion } from "./state/questions";
import { useSettings } from "./state/settings";
import { useStudio } from "./state/studio";
import { useTour } from "./state/tour";

interface Store {
  getInitialState: () => unknown;
  setState: (state: never, replace: true) => void;
}

const STORES: Store[] = [
  useDialogs, useDraft, useHistory, useMat, useMission, usePair, usePupil, usePython, useQuestion, useRemote,
  useSettings, useSockets, useStops, useStudio, useTour, useTrials,
];

beforeAll(() => {
  for (const store of STORES) store.setState(store.getInitialState() as never, true);
});
