# The common part of the findings, which source this file. Each finding is a script that downloads pinned public
# packages into a temporary folder, shows what they do with valid input, and exits with 1 if that has changed, or with
# 2 if a package cannot be had. Nothing is installed on the machine. Run as root: the packages run in a chroot.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
differs=0

# debian PACKAGE=VERSION...: unpacks Debian 12 packages and their dependencies below $work/system. An empty status file
# makes apt list all dependencies, also those that the machine has.
debian() {
  mkdir -p "$work/archives/partial" "$work/system"
  touch "$work/status"
  if ! apt-get -qq --yes --download-only -o Dir::State::status="$work/status" \
    -o Dir::Cache::archives="$work/archives" -o Debug::NoLocking=1 -o APT::Sandbox::User=root \
    -o APT::Install-Recommends=false install "$@" >"$work/apt.log" 2>&1; then
    tail -n 3 "$work/apt.log" >&2
    echo "not available: $* (is the package list up to date?)" >&2
    exit 2
  fi
  local package
  for package in "$work"/archives/*.deb; do dpkg-deb --extract "$package" "$work/system"; done
  rm -r "$work/archives"
  mkdir -p "$work/system/dev" "$work/system/tmp"
  [ -e "$work/system/dev/null" ] || mknod -m 666 "$work/system/dev/null" c 1 3
  [ -e "$work/system/dev/urandom" ] || mknod -m 666 "$work/system/dev/urandom" c 1 9
}

# within COMMAND...: runs a command of the unpacked packages. Its /tmp is $work/system/tmp. The folders of libraries
# that Debian selects by links (alternatives) are named, because no maintainer script has run.
within() {
  local libraries=/usr/lib/x86_64-linux-gnu
  env -i HOME=/tmp LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/bin \
    LD_LIBRARY_PATH="$libraries/blas:$libraries/lapack:$libraries/openblas-pthread:$libraries/pulseaudio" \
    "$(command -v chroot)" "$work/system" "$@"
}

# observe WHAT SEEN RECORDED: prints what was seen, and notes whether it is still what this script records.
observe() {
  if [ "$2" = "$3" ]; then
    printf 'as recorded: %s: %s\n' "$1" "$2"
  else
    printf 'CHANGED: %s: %s (recorded: %s)\n' "$1" "$2" "$3"
    differs=1
  fi
}
