#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Runs the pytest suite under Python's development mode with the module alone built for the address
# and undefined behaviour sanitizers. Memory that CPython or another package leaves at its end is
# not ours: a leak counts if the first function below the allocator is in dyop's module, unless
# tests/python/lsan_suppressions.txt names it.
# Usage: bash tests/sanitize_python.sh [PYTEST_ARGUMENT...]     default: all but the leak and study tests
set -euo pipefail
cd "$(dirname "$0")/.."
build=$PWD/build/asan-python
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" \
  -DCMAKE_UNITY_BUILD=ON -DDYOP_SANITIZER=address -DDYOP_BUILD_TESTS=OFF -DDYOP_BUILD_EXAMPLES=OFF \
  -DDYOP_BUILD_CLI=OFF -DPython_EXECUTABLE=/usr/bin/python3 > /dev/null
cmake --build "$build" --target dyop_python

# The leak test measures what the sanitizer's quarantine keeps; workers of a study are processes.
tests=("$@")
if [ $# -eq 0 ]; then
  for test in tests/python/test_*.py; do
    case $test in *test_leaks.py | *test_study.py) ;; *) tests+=("$test") ;; esac
  done
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
library() { g++ -print-file-name="$1"; }
# Objects of Python come from malloc one by one, and its threads are not followed to their ends.
status=0
env LD_PRELOAD="$(library libasan.so) $(library libstdc++.so)" PYTHONPATH="$build/python" \
  PYTHONMALLOC=malloc PYTHONDONTWRITEBYTECODE=1 \
  ASAN_OPTIONS=detect_leaks=1:exitcode=0:halt_on_error=0:detect_odr_violation=0 \
  UBSAN_OPTIONS=print_stacktrace=1 \
  LSAN_OPTIONS="suppressions=$PWD/tests/python/lsan_suppressions.txt:print_suppressions=0" \
  /usr/bin/python3 -X dev -m pytest -q -p no:cacheprovider "${tests[@]}" > "$log" 2>&1 || status=$?
sed '/^=*$/d; /LeakSanitizer: detected/,$d' "$log"

# Errors, and leaks that began in the module.
errors=$(grep -cE 'ERROR: AddressSanitizer|runtime error:' "$log" || true)
leaks=$(awk '/^(Direct|Indirect) leak of/ { head = $0; stack = ""; is_open = 1; found = is_ours = 0; next }
             is_open && /^ +#/ {
               stack = stack $0 "\n"
               if (!found && $0 !~ /libasan|libstdc\+\+|operator new|interceptor|ext\/new_allocator|bits\//) {
                 found = 1; is_ours = $0 ~ /_dyop/
               }
               next
             }
             is_open && /^$/ { if (is_ours) print head "\n" stack; is_open = found = is_ours = 0 }' "$log")
count=$(grep -c '^Direct leak' <<< "$leaks" || true)
if [ "$errors" -ne 0 ]; then
  grep -E -A 25 'ERROR: AddressSanitizer|runtime error:' "$log" >&2
fi
if [ "$count" -ne 0 ]; then echo "$leaks" >&2; fi
echo "sanitizers: $errors errors, $count leaks of the module, pytest's exit code $status"
[ "$errors" -eq 0 ] && [ "$count" -eq 0 ] && [ "$status" -eq 0 ]
