import { useEffect, useState } from "react";
import type { ClassView, TeacherAnswer } from "../generated/classroom";
import { ClassStream } from "./ask";

/** The class, as it changes. */
export function useClass(): { view: ClassView | null; open: boolean } {
  const [view, setView] = useState<ClassView | null>(null);
  const [open, setOpen] = useState(false);
  useEffect(() => {
    const stream = new ClassStream<TeacherAnswer>("/api/teacher/stream", {
      onAnswer: (answer) => answer.is === "class" && setView(answer),
      onLink: setOpen,
    });
    return () => stream.close();
  }, []);
  return { view, open };
}
