#!/usr/bin/env bash
# soak_test.sh SENTREE SOURCE_DIR WORK_DIR [SECONDS]: a mission that starts again and again, with every part in a process of its own, for
# a minute (or SECONDS, e.g. 3600) of wall time. Now and then a part is stopped for two seconds, so that calls are late and connections are
# made anew. At the end no process has more descriptors than when the mission had used every part for the first time. After the first third
# none has more memory but for what the allocator keeps in pieces and for the index of the recording (some 400 bytes for each 10 s of the
# run), nor more threads but for those that are started when first needed: two of the scheduler, which start when others are busy, and one
# for each other part that is called (at most two), which waits for late replies.
set -euo pipefail
sentree=$(realpath "$1") source=$(realpath "$2") work=$3 length=${4:-60}
rm -rf "$work" && mkdir -p "$work"
cd "$work" # where the run is recorded
work=$PWD
export XDG_RUNTIME_DIR=$work
cat >"$work/soak.yaml" <<END
project: $source/tests/projects/resilient
clock: {real: 20}
override: {mission: {repeat: true}}
duration: $((length * 200)) s
END

"$sentree" run "$work/soak.yaml" --processes >"$work/log" 2>&1 &
run=$!
ended() {
  local code=$?
  kill "$run" 2>/dev/null || true
  ((code == 0)) || tail -30 "$work/log"
}
trap ended EXIT

# Prints the parts' processes in the order started.
parts() { grep -ls "^PPid:[[:space:]]*$run\$" /proc/[0-9]*/status | grep -o '[0-9]*' | sort -n; }
# "PID NAME RSS_KB DESCRIPTORS THREADS" of the run and of its parts.
sample() {
  local pid
  for pid in $run $(parts); do
    echo "$pid" "$(tr '\0' ' ' <"/proc/$pid/cmdline" | cut -d' ' -f2,4 | tr ' ' ':')" "$(awk '/^VmRSS/ {print $2}' "/proc/$pid/status")" \
      "$(find "/proc/$pid/fd" -mindepth 1 2>/dev/null | wc -l)" "$(awk '/^Threads/ {print $2}' "/proc/$pid/status")"
  done
}
# A connection that is being made anew is one descriptor more or less for a moment: the most or the least of ten samples.
samples() { # most | least
  for _ in {1..10}; do
    sample
    pass 2
  done | awk -v want="$1" '
    !($1 in seen) { seen[$1] = ++count; pid[count] = $1; name[$1] = $2 }
    { for (i = 3; i <= 5; i++) if (!(($1, i) in of) || (want == "most" ? $i > of[$1, i] : $i < of[$1, i])) of[$1, i] = $i }
    END { for (n = 1; n <= count; n++) print pid[n], name[pid[n]], of[pid[n], 3], of[pid[n], 4], of[pid[n], 5] }'
}
# Waits for so many tenths of a second, as long as the run lives.
pass() {
  local until=$((${EPOCHREALTIME//[.,]/} + $1 * 100000))
  while ((${EPOCHREALTIME//[.,]/} < until)) && kill -0 $run; do read -rt 0.1 <> <(:) || true; done
}
# Waits for a twelfth of the time, in which one of the parts, each in its turn, stands still for two seconds.
stalls=0
pass_with_stall() {
  local all
  pass $((length * 10 / 12 - 20))
  mapfile -t all < <(parts)
  kill -STOP "${all[stalls % ${#all[@]}]}"
  pass 20
  kill -CONT "${all[stalls++ % ${#all[@]}]}"
}

until grep -qs SUCCESS "$work/log"; do pass 1 && kill -0 $run; done
samples most >"$work/first"
for _ in {1..4}; do pass_with_stall; done
pass 10
samples most >"$work/early"
for _ in {1..6}; do pass_with_stall; done
pass 20
samples least >"$work/late"
kill -INT $run
wait $run || code=$?
[[ ${code:-0} -eq 130 || ${code:-0} -eq 0 ]] || { echo "the run exited with $code" && exit 1; }

join "$work/first" "$work/early" | join - "$work/late" | awk '
  { printf "%s: %d -> %d kB, %d -> %d descriptors, %d -> %d threads\n", $2, $7, $11, $4, $12, $9, $13
    if ($11 > 1.1 * $7 + 2048 || $12 > $4 || $13 > $9 + 4) { print "  grew"; failed = 1 } }
  END { exit failed || NR < 3 }'
