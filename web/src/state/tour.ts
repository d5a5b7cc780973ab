import { create } from "zustand";
import { useSettings } from "./settings";

/** Whether the tour of a first visit shows. */
export const useTour = create<{ shows: boolean }>(() => ({ shows: false }));

/** Show the tour; whoever has gone on from what a first visit finds doesn't see it again. */
export function showTour(): void {
  useSettings.setState({ toured: true });
  useTour.setState({ shows: true });
}

export const endTour = () => useTour.setState({ shows: false });
