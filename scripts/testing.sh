# Sourced after common.sh by ./test and the builds with sanitizers: how tests are run.
# shellcheck shell=bash disable=SC2154  # root is of common.sh

# What fails beside other tests runs once more, alone: then the machine's load is not the cause. Both results are said.
# Where CI is set, what passes only alone has failed: nobody would look into it. Except for what has deadlines of the wall
# clock, mostly in several processes, which a machine shared with others misses now and then: whole labels, and some more
# by their names, but not those of them that run in virtual time. What a sanitizer has found counts, whether it is found again or not.
wall_clock_labels='^(campaign|cli|exec|groot|http|nav2|processes|ros|rpc|runtime|studio|yarp)$'
wall_clock_names='^(ReplayedTimers|hosts|soak|docs|scenarios|package|install)\.'
virtual_time_names='^(DamagedState|Experiments|ForeignMonitor|RandomMissions|Recharge|Run/Forked|VirtualHost|VirtualScheduler)[./]'
run_ctest() {
  local failures=$root/build/$1/Testing/Temporary/LastTestsFailed.log
  say "Testing build/$1"
  rm -f "$failures"
  (cd "$root" && ctest --preset "$1" --parallel "$(jobs)" "${@:2}") && return
  local status=$?
  if grep -Eq '(ERROR: (Address|Leak|Thread)|WARNING: Thread)Sanitizer|: runtime error: ' "${failures%/*}/LastTest.log"; then
    say "A sanitizer has found something in build/$1"
    return "$status"
  fi
  [[ -s $failures && $(wc -l <"$failures") -le 25 ]] || return "$status"
  local names strict=${CI:-} lenient
  lenient=$(cd "$root" && ctest --preset "$1" -N -L "$wall_clock_labels" | sed -n 's/^ *Test *#[0-9]*: //p' | grep -Ev "$virtual_time_names")
  sed 's/^[0-9]*://' "$failures" | grep -Ev "$wall_clock_names" | grep -Fxvq -f <(echo "$lenient") || strict=
  names=$(sed 's/^[0-9]*://' "$failures" | paste -sd ' ')
  say "Failed beside other tests, now each alone: $names"
  (cd "$root" && ctest --preset "$1" --parallel 1 --rerun-failed --repeat until-pass:3) || return
  say "Passed alone, but not beside other tests, which should be looked into: $names"
  [[ -z $strict ]] || return "$status"
}
