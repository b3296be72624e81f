#include "crackle/pc_circulant.hpp"

#include <memory>
#include <stdexcept>

#include "crackle/pc_shell.hpp"
#include "crackle/periodic_inverse.hpp"

namespace crackle {

namespace {

constexpr const char* kType = "circulant";

struct Circulant {
  std::unique_ptr<PeriodicInverse> inverse;
};

Circulant& data(PC pc) {
  return *static_cast<Circulant*>(pc->data);
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

PetscErrorCode destroy(PC pc) {
  delete static_cast<Circulant*>(pc->data);  // NOLINT(*-owning-memory): PETSc hands it back
  pc->data = nullptr;
  return 0;
}

PetscErrorCode create(PC pc) {
  pc->data = new Circulant;  // NOLINT(*-owning-memory): PETSc keeps it
  pc->ops->setup = set_up;
  pc->ops->apply = apply;
  pc->ops->applytranspose = apply;
  pc->ops->view = view;
  pc->ops->destroy = destroy;
  return 0;
}

}  // namespace

PetscErrorCode register_pc_circulant() {
  return PCRegister(kType, create);
}

bool is_pc_circulant(PC pc) {
  PetscBool same = PETSC_FALSE;
  petsc::check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), kType, &same));
  return same == PETSC_TRUE;
}

void pc_circulant_set_network(PC pc, const Network& network) {
  data(pc).inverse = std::make_unique<PeriodicInverse>(network);
}

}  // namespace crackle
