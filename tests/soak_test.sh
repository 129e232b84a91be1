#!/usr/bin/env bash
# soak_test.sh SENTREE SOURCE_DIR WORK_DIR [SECONDS]: a mission that starts again and again, with every part in a process of its own, for
# a minute (or SECONDS, e.g. 3600) of wall time. Memory, file descriptors and threads of no process grow after the first third, but for a
# thread or two of the scheduler, which starts them when others are busy.
set -euo pipefail
sentree=$1 source=$2 work=$3 length=${4:-60}
rm -rf "$work" && mkdir -p "$work"
export XDG_RUNTIME_DIR=$work
cat >"$work/soak.yaml" <<END
project: $source/tests/projects/resilient
clock: {real: 20}
override: {mission: {repeat: true}}
duration: $((length * 20)) s
END

"$sentree" run "$work/soak.yaml" --processes >"$work/log" 2>&1 &
run=$!
trap 'kill $run 2>/dev/null || true' EXIT

# "NAME RSS_KB FDS THREADS" of the run and of its children, in the order started.
sample() {
  local pid
  for pid in $run $(grep -ls "^PPid:[[:space:]]*$run\$" /proc/[0-9]*/status | grep -o '[0-9]*' | sort -n); do
    echo "$(tr '\0' ' ' <"/proc/$pid/cmdline" | cut -d' ' -f2,4)" "$(awk '/^VmRSS/ {print $2}' "/proc/$pid/status")" \
      "$(find "/proc/$pid/fd" -mindepth 1 2>/dev/null | wc -l)" "$(awk '/^Threads/ {print $2}' "/proc/$pid/status")"
  done
}
# Waits, as long as the run lives.
pass() {
  local until=$((SECONDS + $1))
  while ((SECONDS < until)) && kill -0 $run; do read -rt 0.1 <> <(:) || true; done
}

pass $((length / 3))
sample >"$work/early"
pass $((length / 3))
pass $((length / 4))
sample >"$work/late"
kill -0 $run || { cat "$work/log" && exit 1; }
wait $run || code=$?
[[ ${code:-0} -eq 124 || ${code:-0} -eq 0 ]] || { echo "the run exited with $code" && tail -5 "$work/log" && exit 1; }

paste -d' ' "$work/early" "$work/late" | awk '
  { printf "%s: %d -> %d kB, %d -> %d descriptors, %d -> %d threads\n", $1 " " $2, $(NF/2-2), $(NF-2), $(NF/2-1), $(NF-1), $(NF/2), $NF
    if ($(NF-2) > 1.1 * $(NF/2-2) + 2048 || $(NF-1) > $(NF/2-1) || $NF > $(NF/2) + 2) { print "  grew"; failed = 1 } }
  END { exit failed || NR < 3 }'
