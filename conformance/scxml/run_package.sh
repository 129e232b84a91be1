#!/bin/sh
# run_package.sh w3c RUNNER FOLDER: fetches the W3C's SCXML tests into FOLDER, checks their hash, and runs them: all 193
# automatic ones must pass, and a document whose `pass` leads to `fail` must be found out.
# run_package.sh scion RUNNER FOLDER DEVIATIONS: the same for SCION's own 127 tests in that package, less the deviations.
# 77 (skipped) without network or npm.
set -eu
tests=$1
runner=$2
folder=$3
package=@scion-scxml/test-framework@2.0.16
sha512=5rRd5CdFLUzmPaO43NSamBmhq6uW/0kUmUneEnqRSbAj0FiFVAINd1DfadUkdECT+xHLARCJZU7meQD4nqYyKw==

mkdir -p "$folder"
cd "$folder"
archive=scion-scxml-test-framework-2.0.16.tgz
if [ ! -f "$archive" ]; then
  if ! command -v npm >/dev/null; then echo "SKIPPED: npm is not installed, so the W3C tests cannot be fetched"; exit 77; fi
  if ! npm pack --silent "$package" >/dev/null 2>&1; then echo "SKIPPED: no network, so the W3C tests cannot be fetched"; exit 77; fi
fi
if [ "$(openssl dgst -sha512 -binary "$archive" | base64 -w0)" != "$sha512" ]; then
  echo "$archive is not the package that was pinned"
  rm -f "$archive"
  exit 1
fi
tar xzf "$archive"
if [ "$tests" = scion ]; then
  report=$("$runner" package/test "$4" --json) || { echo "$report"; exit 1; }
  echo "$report"
  case $report in
    '{"passed":123,"failed":[],'*) exit 0 ;;
    *) echo "not all of the 127 tests ran"; exit 1 ;;
  esac
fi
suite=package/test/w3c-ecma

report=$("$runner" "$suite" --json) || true
echo "$report"
case $report in
  '{"passed":193,"failed":[],'*) ;;
  *) echo "not all of the 193 automatic tests pass"; exit 1 ;;
esac

rm -rf altered
cp -r "$suite" altered
sed -i 's/target="pass"/target="fail"/' altered/test144.txml.scxml
altered=$("$runner" altered --json 2>/dev/null) && { echo "an altered document was not found out"; exit 1; }
case $altered in
  '{"passed":192,"failed":["144"],'*) echo "the altered document was found out" ;;
  *) echo "unexpected: $altered"; exit 1 ;;
esac
