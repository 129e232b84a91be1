#!/usr/bin/env bash
# Tests of ./demo and ./test with stand-ins for apt-get, sudo, cmake and the rest: nothing is installed or built.
# Usage: scripts_test.sh REPOSITORY WORK_DIR
# shellcheck disable=SC2016  # the stand-ins expand their own arguments
set -euo pipefail

repository=$1
work=$2
failures=0
unset CI

# A copy of the scripts with a PATH of its own: every stand-in writes its command line to `calls`.
set_up() {
  rm -rf "$work"
  mkdir -p "$work/repo/build/release/bin" "$work/repo/examples/recharge" "$work/repo/fuzz" "$work/bin" "$work/elsewhere"
  cp -r "$repository/demo" "$repository/test" "$repository/scripts" "$work/repo/"
  printf '# comment\nninja-build  # why\n\ng++\n' >"$work/repo/apt-packages.txt"
  calls=$work/calls
  : >"$calls"
  installed='installed g++\ninstalled ninja-build\nconfig-files cmake\n'
  user=1000
  for tool in bash cat sed sort comm dirname basename realpath awk nproc env mkdir grep tail touch rm wc paste date find; do ln -s "$(command -v $tool)" "$work/bin/$tool"; done
  stub apt-get 'exit 0'
  stub sudo 'exec "$@"'
  stub ninja 'exit 0'
  stub python3 'exit 0'
  stub ctest 'echo "100% tests passed"'
  stub cmake 'if [[ $1 == --preset ]]; then mkdir -p "build/$2"; touch "build/$2/CMakeCache.txt" "build/$2/build.ninja"; fi'
  stub_at "$work/repo/build/release/bin/sentree" sentree 'exit 7'
}

stub() { stub_at "$work/bin/$1" "$1" "$2"; }
stub_at() { printf '#!/usr/bin/env bash\necho "%s $*" >>"%s"\n%s\n' "$2" "$calls" "$3" >"$1" && chmod +x "$1"; }

# run EXPECTED_STATUS COMMAND…: in another folder than the repository; output goes to $work/output.
run() {
  local expected=$1 status=0
  shift
  printf '#!/usr/bin/env bash\nprintf "%s"\n' "$installed" >"$work/bin/dpkg-query" && chmod +x "$work/bin/dpkg-query"
  printf '#!/usr/bin/env bash\necho %s\n' "$user" >"$work/bin/id" && chmod +x "$work/bin/id"
  (cd "$work/elsewhere" && PATH=$work/bin "$@") >"$work/output" 2>&1 || status=$?
  if [[ $status -ne $expected ]]; then problem "status $status instead of $expected from: $*"; fi
}

problem() {
  failures=$((failures + 1))
  printf 'FAILED %s: %s\n--- output\n%s\n--- calls\n%s\n' "$name" "$1" "$(cat "$work/output")" "$(cat "$calls")"
}
expect_call() { grep -Eq "^$1" "$calls" || problem "no call like: $1"; }
expect_no_call() { ! grep -Eq "^$1" "$calls" || problem "a call like: $1"; }
expect_output() { grep -Fq -- "$1" "$work/output" || problem "no output like: $1"; }

name="installs nothing when nothing is missing"
set_up
run 7 "$work/repo/demo"
expect_no_call 'apt-get|sudo'

name="builds the command only, and passes on its arguments and its exit code"
set_up
run 7 "$work/repo/demo" --headless --scenario experiment1
expect_call 'cmake --preset release -G Ninja'
expect_call 'cmake --build --preset release .*--target sentree'
expect_call 'sentree run ../repo/examples/recharge --headless --scenario experiment1'

name="configures once"
set_up
run 7 "$work/repo/demo" --headless
: >"$calls"
run 7 "$work/repo/demo" --headless
expect_no_call 'cmake --preset'

name="runs headless when the output is no terminal, and says so"
set_up
run 7 "$work/repo/demo"
expect_call 'sentree run .* --headless'
expect_output 'no terminal'

name="installs what is missing, and only that, with sudo, saying so"
set_up
installed='installed g++\ndeinstall ninja-build\n'
run 7 "$work/repo/demo"
expect_output 'with sudo'
expect_call 'sudo apt-get update'
expect_call 'apt-get install .*--no-install-recommends ninja-build$'

name="does not use sudo as root"
set_up
installed='installed g++\n'
user=0
run 7 "$work/repo/demo"
expect_call 'apt-get install .* ninja-build$'
expect_no_call 'sudo'

name="says what to do without root and sudo"
set_up
installed=''
rm "$work/bin/sudo"
run 4 "$work/repo/demo"
expect_output 'As root, run: apt-get update && apt-get install --no-install-recommends g++ ninja-build'
expect_no_call 'cmake'

name="stops when packages cannot be installed"
set_up
installed=''
stub apt-get '[[ $1 != install ]]'
run 4 "$work/repo/demo"
expect_output 'could not install'

name="goes on without apt-get"
set_up
rm "$work/bin/apt-get"
run 7 "$work/repo/demo"
expect_output 'No apt-get here'

name="installs Node only for the web page, and only where it is missing"
set_up
mkdir "$work/repo/web" && echo '{}' >"$work/repo/web/package.json"
stub npm 'exit 0'
run 7 "$work/repo/demo"
expect_call 'apt-get install .* nodejs$'

name="stops when the build fails"
set_up
stub cmake 'exit 3'
run 3 "$work/repo/demo"
expect_no_call 'sentree run'

name="builds everything and runs ctest with the given arguments"
set_up
run 0 "$work/repo/test" -R recharge
expect_call 'cmake --build --preset release --parallel [0-9]+$'
expect_call 'ctest --preset release --parallel [0-9]+ -R recharge'

name="fails when a test fails"
set_up
stub ctest 'exit 8'
run 8 "$work/repo/test"

# A ctest whose first run fails the given tests; A.wall has a label of those with deadlines of the wall clock.
stub_failing_ctest() {
  stub ctest 'failed='"$work"'/repo/build/release/Testing/Temporary/LastTestsFailed.log
[[ " $* " == *" --rerun-failed "* ]] && exit '"$1"'
[[ " $* " == *" -N -L "* ]] && { echo "  Test #7: A.wall"; echo "  Test #8: RandomMissions.OfSeeds"; exit 0; }
mkdir -p "${failed%/*}" && printf "'"$2"'" >"$failed"; exit 8'
}

name="runs what failed once more alone, and says so"
set_up
stub_failing_ctest 0 '7:A.b\n9:C.d\n'
run 0 "$work/repo/test"
expect_call 'ctest --preset release --parallel 1 --rerun-failed --repeat until-pass:3'
expect_output 'Passed alone, but not beside other tests, which should be looked into: A.b C.d'

name="counts what passes only alone as failed where CI is set, and says which it was"
set_up
stub_failing_ctest 0 '7:A.b\n9:C.d\n'
run 8 env CI=true "$work/repo/test"
expect_output 'Passed alone, but not beside other tests, which should be looked into: A.b C.d'

name="forgives what misses deadlines of the wall clock, also where CI is set"
set_up
stub_failing_ctest 0 '7:A.wall\n9:soak.a_minute\n'
run 0 env CI=true "$work/repo/test"
stub_failing_ctest 0 '7:A.wall\n9:A.wallet\n'
run 8 env CI=true "$work/repo/test"

name="forgives nothing that runs in virtual time where CI is set"
set_up
stub_failing_ctest 0 '8:RandomMissions.OfSeeds\n'
run 8 env CI=true "$work/repo/test"

name="forgives nothing that a sanitizer has found"
set_up
stub_failing_ctest 0 '7:A.b\n'
mkdir -p "$work/repo/build/release/Testing/Temporary"
echo '==1==ERROR: AddressSanitizer: heap-use-after-free' >"$work/repo/build/release/Testing/Temporary/LastTest.log"
run 8 "$work/repo/test"
expect_output 'A sanitizer has found something'
expect_no_call 'ctest .* --rerun-failed'

name="fails when a test fails alone too"
set_up
stub_failing_ctest 8 '7:A.b\n'
run 8 "$work/repo/test"
expect_call 'ctest --preset release --parallel 1 --rerun-failed --repeat until-pass:3'

name="does not repeat when many fail"
set_up
stub_failing_ctest 0 "$(seq -f '%g:a' -s '\\n' 26)\\n"
run 8 "$work/repo/test"
expect_no_call 'ctest .* --rerun-failed'

name="tests with sanitizers and fuzzes in the long mode, and ends with the release build"
set_up
stub clang++-19 'exit 0'
mkdir -p "$work/repo/build/fuzz/bin" "$work/repo/build/release/tests"
stub_at "$work/repo/build/fuzz/bin/text_xml_fuzz" text_xml_fuzz 'exit 0'
run 0 "$work/repo/test" --long
expect_call 'ctest --preset asan'
expect_call 'ctest --preset tsan'
expect_call 'text_xml_fuzz -max_total_time=60'
[[ $(grep '^ctest' "$calls" | tail -n 1) == "ctest --preset release"* ]] || problem "the last tests are not those of release"
expect_call '.*attack/chances_test.py'
[[ $(tail -n 1 "$calls") == *durable_test.py*--processes* ]] || problem "the kills are not the last call"

name="reports a failing fuzz target, after running the rest"
set_up
stub clang++-19 'exit 0'
mkdir -p "$work/repo/build/fuzz/bin"
stub_at "$work/repo/build/fuzz/bin/a_fuzz" a_fuzz 'exit 77'
stub_at "$work/repo/build/fuzz/bin/b_fuzz" b_fuzz 'exit 0'
run 1 "$work/repo/test" --long
expect_call 'b_fuzz'
expect_call 'ctest --preset release'
expect_output 'a_fuzz found a failing input'

if [[ $failures -gt 0 ]]; then
  echo "$failures failed"
  exit 1
fi
echo "all passed"
