#include "crackle/record/observe_snapshot.hpp"

#include <algorithm>
#include <utility>

namespace crackle {

ObserveSnapshot::ObserveSnapshot(std::vector<std::int32_t> at, SampleRecord& record)
    : at_(std::move(at)), record_(record) {}

void ObserveSnapshot::sample_begins(std::int64_t /*index*/) {
  record_.snapshots.clear();
}

void ObserveSnapshot::sample_resumes(const SampleRecord& begun) {
  record_.snapshots = begun.snapshots;
}

void ObserveSnapshot::bond_breaks(std::int32_t number, const Critical& critical, Equilibrium& equilibrium) {
  if (!std::ranges::binary_search(at_, number)) return;
  record_.snapshots.push_back(take_snapshot(number, critical.load, equilibrium));
}

Snapshot take_snapshot(std::int32_t number, double load, Equilibrium& equilibrium) {
  const Network& network = equilibrium.network();
  const auto u = equilibrium.displacements();
  Snapshot snapshot{.number = number};
  snapshot.displacement.reserve(network.dof.size());
  for (const Dof dof : network.dof)
    snapshot.displacement.push_back(dof == Network::kFixed ? 0 : load * u[dof]);
  snapshot.force = equilibrium.forces();
  for (double& force : snapshot.force) force *= load;
  return snapshot;
}

}  // namespace crackle
