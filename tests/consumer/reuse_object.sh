#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A compiler launcher: takes the object from DYOP_REUSED_BUILD, a build of the same sources with the
# same flags, if it is there; otherwise it compiles.
set -euo pipefail
arguments=("$@")
for ((i = 0; i < $#; i++)); do
  case ${arguments[i]} in
    -o) object=${arguments[i + 1]} ;;
    -MF) dependencies=${arguments[i + 1]} ;;
  esac
done
if [ -n "${object:-}" ] && [ -f "$DYOP_REUSED_BUILD/$object" ]; then
  cp "$DYOP_REUSED_BUILD/$object" "$object"
  if [ -n "${dependencies:-}" ]; then : > "$dependencies"; fi
  exit 0
fi
exec "$@"
