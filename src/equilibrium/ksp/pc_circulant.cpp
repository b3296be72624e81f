#include "crackle/equilibrium/ksp/pc_circulant.hpp"

#include <memory>
#include <stdexcept>

#include "crackle/equilibrium/ksp/pc_shell.hpp"
#include "crackle/equilibrium/ksp/periodic_inverse.hpp"

namespace crackle {

namespace {

constexpr const char* kType = "circulant";

struct Circulant {
  std::unique_ptr<PeriodicInverse> inverse;
};

Circulant& data(PC pc) {
  return pc_data<Circulant>(pc);
}

PetscErrorCode set_up(PC pc) {
  return guarded(pc, kType, [pc] {
    if (data(pc).inverse == nullptr) throw std::runtime_error("-pc_type circulant has no network");
  });
}

PetscErrorCode apply(PC pc, Vec b, Vec x) {
  return guarded(pc, kType, [pc, b, x] {
    with_arrays(b, x, [pc](auto load, auto solution) { data(pc).inverse->solve(load, solution); });
  });
}

PetscErrorCode view(PC /*pc*/, PetscViewer viewer) {
  return PetscViewerASCIIPrintf(viewer,
                                "  inverse of the intact lattice: FFT along x, block tridiagonal along y\n");
}

PetscErrorCode create(PC pc) {
  pc_create<Circulant>(pc, set_up, apply, view);
  return 0;
}

}  // namespace

PetscErrorCode register_pc_circulant() {
  return PCRegister(kType, create);
}

bool is_pc_circulant(PC pc) {
  return pc_has_type(pc, kType);
}

void pc_circulant_set_network(PC pc, const Network& network) {
  data(pc).inverse = std::make_unique<PeriodicInverse>(network);
}

}  // namespace crackle
