export function TimelinePanel() {
  return <div className="empty">Timeline</div>;
}
