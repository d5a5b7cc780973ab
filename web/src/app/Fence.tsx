import { Component, type ReactNode } from "react";

interface FenceProps {
  /** What is shown in place of what failed. */
  fallback?: (retry: () => void) => ReactNode;
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
    if (!this.state.failed) return this.props.children;
    return this.props.fallback?.(() => this.setState({ failed: false }));
  }
}
