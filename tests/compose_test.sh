#!/usr/bin/env bash
# compose_test.sh SENTREE SOURCE_DIR WORK_DIR: the commands of compose.yaml, each as a process with a loopback address and the name of its own
# that its container would have. 77 (skipped) unless root, with unshare.
set -euo pipefail
sentree=$1 source=$2 work=$3
if [[ $(id -u) -ne 0 ]] || ! unshare --mount true 2>/dev/null; then
  echo "SKIPPED: giving hosts names needs root and mount namespaces" && exit 77
fi
if [[ ${4:-} != inside ]]; then
  rm -rf "$work" && mkdir -p "$work"
  exec unshare --mount --propagation private bash "$0" "$sentree" "$source" "$work" inside
fi
cd "$source"
export XDG_RUNTIME_DIR=$work

mapfile -t parts < <(awk '/^services:/ {inside = 1; next} /^[a-z]/ {inside = 0} inside && /^  [a-z-]+:$/ {sub(":", "", $1); print $1}' compose.yaml)
[[ ${#parts[@]} -eq 7 ]] || { echo "compose.yaml has ${#parts[@]} services" && exit 1; }
printf '127.0.0.1 localhost\n' >"$work/hosts"
for i in "${!parts[@]}"; do printf '127.0.77.%d %s\n' $((i + 1)) "${parts[i]}" >>"$work/hosts"; done
mount --bind "$work/hosts" /etc/hosts

# The command of a service; it listens on its own address instead of on all.
command_of() {
  awk -v part="  $1:" '$0 == part {inside = 1; next} /^  [a-z-]+:$/ {inside = 0} inside && /^    command:/ {sub("    command: ", ""); print}' compose.yaml |
    sed -e "s|0\.0\.0\.0|$1|" -e "s|\${EXPERIMENT:-experiment1}|$EXPERIMENT|g"
}

children=()
trap 'kill "${children[@]}" 2>/dev/null || true; wait' EXIT
failures=0
for EXPERIMENT in experiment1 experiment2; do
  children=()
  for part in "${parts[@]}"; do
    [[ $part == mission ]] && continue
    read -ra words < <(command_of "$part")
    : >"$work/$part.log"
    "$sentree" "${words[@]}" >"$work/$part.log" 2>&1 &
    children+=($!)
    until grep -q 'listening on' "$work/$part.log"; do
      kill -0 "${children[-1]}" 2>/dev/null || { cat "$work/$part.log" && exit 1; }
      read -rt 0.05 <> <(:) || true
    done
  done
  read -ra words < <(command_of mission)
  code=0
  "$sentree" "${words[@]}" --json >"$work/$EXPERIMENT.json" 2>"$work/mission.log" || code=$?
  kill "${children[@]}" 2>/dev/null || true
  wait "${children[@]}" 2>/dev/null || true
  # A monitor is violated, and that is what was expected.
  if [[ $code -ne 1 ]] || ! grep -q '"unmet":\[\]' "$work/$EXPERIMENT.json"; then
    echo "✗ $EXPERIMENT exited with $code:" && cat "$work/$EXPERIMENT.json" "$work/mission.log" && failures=1
  else
    echo "✓ $EXPERIMENT"
  fi
done
exit $failures
