#!/usr/bin/env bash
# Sets crackle up on Debian 12 and runs it:
#   ./bootstrap.sh setup   installs what is missing, configures and builds
#   ./bootstrap.sh demo    the same, then breaks 20 samples of a 64 x 64 spring lattice: crackle.h5, crackle.png
#   ./bootstrap.sh test    the same, then runs every test, the short ones also as on other processors
#   ./bootstrap.sh style   the same, then checks format and lint (clang-format, clang-tidy), as CI does
# A second call finds everything there and goes straight to work.
set -euo pipefail
cd "$(dirname "$0")"

packages=(
  g++ cmake ninja-build pkg-config
  petsc-dev libpetsc-real-dev libmumps-dev libsuitesparse-dev libmetis-dev libhdf5-openmpi-dev libfftw3-dev libopenblas-dev
  librandom123-dev libgtest-dev libbenchmark-dev openmpi-bin
  python3 python3-h5py python3-numpy python3-scipy python3-matplotlib python3-pytest
)

# a browser, and what drives it, for the tests of the report's page; what installs the Python package, for those of it
test_packages=(chromium chromium-driver python3-selenium python3-pip python3-setuptools python3-wheel)
style_packages=(clang-format-14 clang-tidy-16)

# installs those of the packages named that are not there
install_missing() {
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then as_root=(sudo); fi
  echo "installing: ${missing[*]}"
  "${as_root[@]}" apt-get update -q
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
}

build() {
  [ -f build/release/build.ninja ] || cmake --preset release
  cmake --build --preset release
}

setup() {
  install_missing "${packages[@]}"
  build
}

demo() {
  setup
  build/release/crackle -options_file options/paper/spring.opts -lattice_size 64 -samples 20 -overwrite
  /usr/bin/python3 postprocess/sample.py crackle.h5 -o crackle.png
}

run_tests() {
  setup
  install_missing "${test_packages[@]}"
  # as root, and on fewer cores than ranks, Open MPI starts only when told that it may
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  ctest --test-dir build/release --output-on-failure --parallel "$(nproc)"
}

check_style() {
  setup
  install_missing "${style_packages[@]}"
  git ls-files '*.cpp' '*.hpp' | xargs clang-format-14 --dry-run -Werror
  run-clang-tidy-16 -quiet -j "$(nproc)" -p build/release "$PWD/src/.*\.cpp" 2>/dev/null
}

case "${1:-}" in
  setup) setup ;;
  demo) demo ;;
  test) run_tests ;;
  style) check_style ;;
  *)
    echo "usage: ./bootstrap.sh setup | demo | test | style" >&2
    exit 2
    ;;
esac
