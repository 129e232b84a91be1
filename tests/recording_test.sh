#!/usr/bin/env bash
# Recordings as users meet them: made by default, kept within bounds, alive after kill -9 and a full disk.
# usage: recording_test.sh SENTREE SOURCE_DIR WORK_DIR
set -euo pipefail
sentree=$1 source=$2 work=$3
rm -rf "$work" && mkdir -p "$work" && cd "$work"
export XDG_RUNTIME_DIR=$work
unset SENTREE_RUNS
failures=0
project=$source/examples/recharge

fail() { echo "✗ $*" && failures=$((failures + 1)); }
# expect CODE PATTERN COMMAND…: the command exits with CODE, and its output (both streams) matches PATTERN.
expect() {
  local code=$1 pattern=$2 got=0
  shift 2
  "$@" >"$work/out" 2>&1 </dev/null || got=$?
  if [[ $got -ne $code ]]; then
    fail "$* exited with $got, expected $code:" && tail -5 "$work/out"
  elif ! grep -qaE -- "$pattern" "$work/out"; then
    fail "$*: nothing matches $pattern:" && tail -5 "$work/out"
  else
    echo "✓ $*"
  fi
}
# number FILE NAME: the first number of that name that `info` knows.
number() { "$sentree" info "$1" --json 2>/dev/null | grep -o "\"$2\":[0-9.]*" | head -1 | cut -d: -f2; }

# By default into runs/, the oldest giving way; elsewhere by SENTREE_RUNS, nowhere if that is empty.
expect 1 'recorded: runs/experiment1-.*\.mcap' "$sentree" run "$project" --scenario experiment1 --clock virtual
expect 0 'monitor battery: violated' "$sentree" info runs/*.mcap
expect 0 '"complete":true' "$sentree" info runs/*.mcap --json
rm runs/*.mcap && touch keep.mcap && mv keep.mcap runs/
for i in $(seq 40); do : >"runs/old-20200101-0000$((10 + i)).mcap" && touch -d "2020-01-01 00:00:$((10 + i))" "runs/old-20200101-0000$((10 + i)).mcap"; done
"$sentree" run "$project" --clock virtual --duration '1 s' >/dev/null 2>&1 || true
[[ $(find runs -name '*.mcap' | wc -l) -eq 31 && -e runs/keep.mcap && ! -e runs/old-20200101-000020.mcap ]] || fail "30 recordings and keep.mcap should be left in runs/"
SENTREE_RUNS=$work/elsewhere "$sentree" run "$project" --clock virtual --duration '1 s' >/dev/null 2>&1 || true
[[ -n $(find elsewhere -name '*.mcap') ]] || fail "nothing was recorded in SENTREE_RUNS"
SENTREE_RUNS='' expect 124 'ended by its time limit' "$sentree" run "$project" --clock virtual --duration '1 s'
grep -q recorded "$work/out" && fail "an empty SENTREE_RUNS did not switch recording off"
expect 124 'ended by its time limit' "$sentree" run "$project" --clock virtual --duration '1 s' --no-record
grep -q recorded "$work/out" && fail "--no-record did not switch recording off"
expect 4 'cannot be written' "$sentree" run "$project" --clock virtual --duration '1 s' --record /proc/nowhere/x.mcap
expect 3 'not a recording' "$sentree" info "$project/mission.xml"

# kill -9 loses at most the last second: what was told a second before is there.
"$sentree" run "$project" --clock real --verbose --record killed.mcap >told 2>&1 &
run=$!
until [[ $(grep -c 'mission.tick' told) -ge 35 ]] || ! kill -0 $run 2>/dev/null; do read -rt 0.02 <> <(:) || true; done
kill -9 $run
wait $run 2>/dev/null || true
expect 0 'the end is missing' "$sentree" info killed.mcap
told=$(sed -n 's/^ *\([0-9.]*\) s .*/\1/p' told | tail -1)
ends=$(number killed.mcap ends)
awk -v told="$told" -v ends="$ends" 'BEGIN { exit !(ends > told - 1.0 && ends > 2) }' || fail "killed at $told s, but the recording ends at $ends s"

# A full disk is told once, and the run goes on to the same end.
code=0
(ulimit -f 300 && "$sentree" run "$project" --scenario experiment1 --clock virtual --json --record full.mcap >full.json 2>full.err) || code=$?
[[ $code -eq 1 ]] || fail "with a full disk the run exited with $code"
[[ $(grep -c 'recording stopped: .*cannot be written' full.err) -eq 1 ]] || fail "the full disk was not told once:" "$(cat full.err)"
"$sentree" run "$project" --scenario experiment1 --clock virtual --json --no-record >free.json 2>/dev/null || true
cmp full.json free.json || fail "the full disk changed the run"
expect 0 'the end is missing' "$sentree" info full.mcap
[[ $(number full.mcap messages) -gt 100 ]] || fail "nothing of full.mcap can be read"

# Interrupted in mid-run, the recording is whole.
"$sentree" run "$project" --clock real --factor 5 --record interrupted.mcap >interrupted 2>&1 &
run=$!
until grep -q 'GoToKitchen: RUNNING' interrupted || ! kill -0 $run 2>/dev/null; do read -rt 0.02 <> <(:) || true; done
kill -TERM $run
wait $run || true
expect 0 'ended by interrupt' "$sentree" info interrupted.mcap

# A run that was started without a page opens one for who attaches; the run ends as without.
expect 4 'no mission runs' "$sentree" studio --attach
expect 4 'is no run that goes on' "$sentree" studio --attach $$
expect 2 'neither the process id of a run nor the address' "$sentree" studio --attach here
expect 2 'needs a project, a recording, --diff with two files, or --attach' "$sentree" studio
started() { until grep -q 'GoToKitchen: RUNNING' "$1" || ! kill -0 "$2" 2>/dev/null; do read -rt 0.02 <> <(:) || true; done; }
"$sentree" run "$project" --clock real --record attached.mcap >attached 2>attached.err &
run=$!
started attached $run
expect 0 "^$run	" "$sentree" __complete studio --attach ''
expect 0 '^the page: http://127.0.0.1:' "$sentree" studio --attach
page=$(sed -n 's/^the page: //p' out)
grep -qxF "somebody attached to this run; the page: $page" attached.err || fail "the run did not tell who attached:" "$(cat attached.err)"
expect 0 "^the page: $page\$" "$sentree" studio --attach $run
expect 0 "^the page: $page\$" "$sentree" studio --attach "$page"
"$sentree" run "$project" --clock real --no-record >unrecorded 2>&1 &
other=$!
started unrecorded $other
expect 4 'several missions run; choose one with --attach PID' "$sentree" studio --attach
expect 4 'is not recorded' "$sentree" studio --attach $other
kill -INT $other $run
wait $other || true
code=0
wait $run || code=$?
[[ $code -eq 130 ]] || fail "the run with a page that was attached exited with $code"
grep -q 'page stays' attached attached.err && fail "a page that was attached kept its run"
expect 0 'ended by interrupt' "$sentree" info attached.mcap
expect 4 'nobody answers' "$sentree" studio --attach "$page"

# Yesterday's failure: told, checked with other monitors, tried with a fixed skill.
"$sentree" run "$project" --scenario experiment2 --clock virtual --record failure.mcap >/dev/null 2>&1 || true
expect 1 'monitor recharge: violated' "$sentree" monitor check failure.mcap
expect 1 'monitor turns_to_station: violated' "$sentree" monitor check failure.mcap --req "$project/requirements/recharge.req"
grep -q 'decided at .* while GoToKitchen was at work' out || fail "the check of a recording does not name the leaf at work"
sed 's/battery.getBatteryState/batery.getBatteryState/' "$project/requirements/recharge.req" >misspelt.req
expect 3 'no service "batery"; did you mean "battery"' "$sentree" monitor check failure.mcap --req misspelt.req
expect 0 'monitor battery: undecided' "$sentree" monitor check failure.mcap --monitor "$project/monitors/battery.scxml" --violated failure
expect 0 'behaves as recorded' "$sentree" replay failure.mcap
expect 0 'turns_to_station +undecided \(pending: owes' "$sentree" replay failure.mcap --at '52.05 s'
expect 0 '"nodes":\{"Root":"RUNNING".*"states":' "$sentree" replay failure.mcap --at '52050 ms' --json
expect 3 'the run was over: it ended at 67.2 s' "$sentree" replay failure.mcap --at '70 s'
expect 2 'is no moment of a run' "$sentree" replay failure.mcap --at noon
expect 1 'monitor recharge: violated at 53.100 s' "$sentree" replay failure.mcap --from '52 s'
cp -r "$project" fixed && cp fixed/skills/BatteryLevelAbove.scxml fixed/skills/BatteryLevelAbove-buggy.scxml
expect 1 'BatteryLevelAbove30' "$sentree" replay failure.mcap --project fixed
grep -q 'AtStation asks .*which was not recorded; the replay ends here' out || fail "the replay did not say which request was not recorded"
expect 1 'mission\.tick, 10 times' "$sentree" monitor check failure.mcap --monitor "$project/monitors/recharge.scxml" --violated failure
expect 1 'the simulator took over' "$sentree" replay failure.mcap --project fixed --continue
grep -q 'monitor recharge: undecided' out || fail "the fixed skill still violates recharge"
expect 0 '^time_s,sequence,tick' "$sentree" export failure.mcap --to csv
expect 0 '^{"topic":"/observations","time_ns":0,' "$sentree" export failure.mcap --to ndjson
expect 0 'traceEvents' "$sentree" export failure.mcap --to perfetto
expect 0 '^BTCPP4-FileLogger2' "$sentree" export failure.mcap --to btlog
expect 0 'GoToKitchen' "$sentree" export failure.mcap --to fbl
expect 0 'call: simulation.setBatteryCharge' "$sentree" export failure.mcap --to scenario
cp -r "$project" same && cp out same/scenarios/again.yaml
expect 0 'again' "$sentree" test same --scenario again
expect 2 'btlog' "$sentree" export failure.mcap --to db3
expect 0 'nodes were ticked' "$sentree" report failure.mcap
grep -q '<td>guards<td>[0-9]*<td>[0-9]' out || fail "the report counts guards"
grep -q 'never reached' out || fail "the report draws what of the charts was never reached"
grep -q 'mission.tick</code> × 10<' out || fail "ticks that only follow each other are one row of the report"
grep -q '<th>by<th>what' out || fail "the interventions of the report have a header"
grep -q 'never emptier than 20 %' out || fail "the report says what an undecided monitor requires"
grep -qE '(src|href)="?http' out && fail "the report needs other pages"
expect 3 'no temporary folder' env TMPDIR=/nowhere "$sentree" replay failure.mcap
expect 4 'no folder for its sockets' env TMPDIR=/nowhere "$sentree" run "$project" --processes --no-record
expect 3 'not a recording' "$sentree" replay "$project/mission.xml"

# The program alone, without the interfaces that come with it, records those of the project under their names.
mkdir alone && cp "$sentree" alone/
expect 124 'ended by its time limit' alone/sentree run "$source/examples/topics" --clock virtual --duration '5 s' --record alone.mcap
expect 0 'behaves as recorded' alone/sentree replay alone.mcap
rm -r alone

# A recording keeps the project's plug-ins, whose code nobody loads who was not told to; mark.so leaves a file where it is loaded.
mkdir coded && cp "$(dirname "$sentree")/../tests/plugins/libmarks_plugin.so" coded/mark.so
echo '<root BTCPP_format="4"><BehaviorTree ID="M"><Mark/></BehaviorTree></root>' >coded/mission.xml
printf 'mission: {file: mission.xml}\nplugins: [mark.so]\n' >coded/sentree.yaml
expect 0 'mission SUCCESS' "$sentree" run coded --clock virtual --record coded.mcap
hash=$(sha256sum coded/mark.so | cut -d' ' -f1)
export SENTREE_TEST_MARK=$work/marked
for command in report replay 'monitor check' studio 'export --to btlog' 'export --to fbl'; do
  # shellcheck disable=SC2086
  expect 3 "plug-in mark\.so \(SHA-256 $hash\) comes with the recording, .*--allow-plugins" "$sentree" $command coded.mcap
done
for command in info 'export --to csv' 'export --to scenario'; do
  # shellcheck disable=SC2086
  "$sentree" $command coded.mcap >/dev/null || fail "$command needs the plug-ins of a recording"
done
[[ ! -e marked ]] || fail "code of a recording has run"
for command in report replay 'monitor check' 'export --to btlog'; do
  rm -f marked
  # shellcheck disable=SC2086
  expect 0 "note: plug-in mark\.so \(SHA-256 $hash\) of the recording is loaded" "$sentree" $command coded.mcap --allow-plugins
  [[ -e marked ]] || fail "$command --allow-plugins did not load the plug-in"
done
rm -f marked
expect 0 'behaves as recorded' "$sentree" replay coded.mcap --project coded
[[ -e marked ]] || fail "a project that the user names does not load its plug-ins"
unset SENTREE_TEST_MARK
mkfifo pipe.mcap
expect 3 'not a regular file' timeout 20 "$sentree" info pipe.mcap

if [[ $failures -gt 0 ]]; then echo "$failures failed" && exit 1; fi
