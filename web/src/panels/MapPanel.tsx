export function MapPanel() {
  return <div className="empty">Map</div>;
}
