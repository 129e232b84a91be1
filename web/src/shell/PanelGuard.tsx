import { Component, type ReactNode } from "react";

interface Props {
  name: string;
  children: ReactNode;
}

/** A panel that fails says so, and leaves the others alone. */
export class PanelGuard extends Component<Props, { error: Error | null }> {
  override state: { error: Error | null } = { error: null };

  static getDerivedStateFromError(error: Error) {
    return { error };
  }

  override render() {
    const { error } = this.state;
    if (!error) return this.props.children;
    return (
      <div className="empty panel-failed" role="alert">
        <p>
          {this.props.name} cannot be shown: {error.message}
        </p>
        <button className="button" onClick={() => this.setState({ error: null })}>
          Try again
        </button>
      </div>
    );
  }
}
