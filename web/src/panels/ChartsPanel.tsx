export function ChartsPanel() {
  return <div className="empty">Charts</div>;
}
