import { Component, type ReactNode } from "react";

interface FenceProps {
  /** What is shown in place of what failed. */
  fallback?: ReactNode;
  onFailure?: () => void;
  children: ReactNode;
}

/** Keeps what fails inside, such as a part of the page that can't be fetched, from taking the rest with it. */
export class Fence extends Component<FenceProps, { failed: boolean }> {
  override state = { failed: false };

  static getDerivedStateFromError(): { failed: boolean } {
    return { failed: true };
  }

  override componentDidCatch(): void {
    this.props.onFailure?.();
  }

  override render(): ReactNode {
    return this.state.failed ? this.props.fallback : this.props.children;
  }
}

/** The way on: a browser that failed to fetch a part of a page doesn't ask for it again. Work is kept of itself. */
export function reload(): void {
  location.reload();
}
