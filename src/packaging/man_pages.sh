#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Writes the manual pages of the dyop command and of each of its commands, from what --help says.
# Usage: bash src/packaging/man_pages.sh DYOP OUT
set -euo pipefail
[ $# -eq 2 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
dyop=$1
out=$2
mkdir -p "$out"

# The commands below the given ones, one a line, each with its description.
commands() {
  "$dyop" "$@" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z0-9-]*  *.*\)/\1/p'
}

# page DESCRIPTION [COMMAND...]
page() {
  local description=$1 also
  shift
  also=$(IFS=-; echo "dyop${*:+-$*}")
  help2man --no-info --section 1 --name "$description" --version-string "$("$dyop" --version | cut -d' ' -f2)" \
    "$dyop${*:+ $*}" | sed -e "s/^\.TH DYOP /.TH ${also^^} /" -e "s/^${also//-/ } \\\\- /$also \\\\- /" > "$out/$also.1"
  commands "$@" | while read -r command text; do
    page "$text" "$@" "$command"
  done
}

page 'certified time of impact of rigid bodies'
