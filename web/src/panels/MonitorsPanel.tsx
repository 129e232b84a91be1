export function MonitorsPanel() {
  return <div className="empty">Monitors</div>;
}
