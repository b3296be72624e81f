#include "crackle/record/part_snapshot.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>
#include <utility>

#include "crackle/record/part.hpp"
#include "crackle/record/rows.hpp"

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

namespace {

std::unique_ptr<Observer> observe_snapshot(const PartScene& scene, SampleRecord& record) {
  return std::make_unique<ObserveSnapshot>(scene.options.snapshot_at, record);
}

void write_snapshots(hid_t file, std::span<const SampleRecord> records) {
  const hdf5::Handle group = hdf5::create_group(file, "snapshots");
  std::vector<std::int64_t> sample;
  std::vector<std::int32_t> number;
  std::vector<double> displacement;
  std::vector<double> force;
  for (const SampleRecord& record : records) {
    for (const Snapshot& snapshot : record.snapshots) {
      sample.push_back(record.summary.index);
      number.push_back(snapshot.number);
      displacement.insert(displacement.end(), snapshot.displacement.begin(), snapshot.displacement.end());
      force.insert(force.end(), snapshot.force.begin(), snapshot.force.end());
    }
  }
  hdf5::write<std::int64_t>(group, "sample", sample);
  hdf5::write<std::int32_t>(group, "number", number);
  hdf5::write<double>(group, "displacement", displacement,
                      sample.empty() ? 1 : displacement.size() / sample.size());
  hdf5::write<double>(group, "force", force, sample.empty() ? 1 : force.size() / sample.size());
}

void read_snapshots(hid_t file, std::span<SampleRecord> records) {
  const auto sample = hdf5::read<std::int64_t>(file, "snapshots/sample");
  std::size_t displacements = 0;
  std::size_t forces = 0;
  const auto number = read_rows<std::int32_t>(file, "snapshots/number", sample.size());
  const auto displacement = read_rows<double>(file, "snapshots/displacement", sample.size(), &displacements);
  const auto force = read_rows<double>(file, "snapshots/force", sample.size(), &forces);
  std::unordered_map<std::int64_t, SampleRecord*> owner;
  for (SampleRecord& record : records) owner[record.summary.index] = &record;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const auto found = owner.find(sample[i]);
    if (found == owner.end()) {
      throw InputError("dataset /snapshots/sample", std::to_string(sample[i]), "numbers in /samples/index");
    }
    found->second->snapshots.push_back(
        {number[i], row_of(displacement, i, displacements), row_of(force, i, forces)});
  }
}

bool same_snapshots(const SampleRecord& a, const SampleRecord& b) {
  return std::ranges::equal(a.snapshots, b.snapshots, [](const Snapshot& x, const Snapshot& y) {
    return x.number == y.number && same_bits(x.displacement, y.displacement) && same_bits(x.force, y.force);
  });
}

void check_snapshot(const SampleRecord& record, const Snapshot& snapshot, const RecordFacts& facts,
                    const Judge& judge) {
  const auto check = [&judge](const char* name, const std::vector<double>& values, std::int64_t size) {
    judge.demand(std::ranges::all_of(values, [](double x) { return std::isfinite(x); }), name,
                 "with a NaN or an infinity", "finite numbers");
    judge.demand(size == 0 || std::ssize(values) == size, name, static_cast<double>(values.size()),
                 std::to_string(size) + " numbers");
  };
  check("/snapshots/force", snapshot.force, facts.bonds);
  check("/snapshots/displacement", snapshot.displacement, facts.displacements);
  const auto before =
      std::min<std::size_t>(static_cast<std::size_t>(snapshot.number) - 1, record.bond.size());
  for (std::size_t i = 0; i < before; ++i) {
    const auto bond = static_cast<std::size_t>(record.bond[i]);
    judge.demand(bond < snapshot.force.size() && snapshot.force[bond] == 0, "/snapshots/force",
                 "of broken bond " + std::to_string(bond), "0");
  }
}

void check_snapshots(const SampleRecord& record, const RecordFacts& facts, const Judge& judge) {
  std::vector<std::int32_t> found;
  for (const Snapshot& snapshot : record.snapshots) {
    judge.demand(snapshot.number >= 1 && snapshot.number <= record.summary.n_f, "/snapshots/number",
                 snapshot.number, "1 to n_f");
    check_snapshot(record, snapshot, facts, judge);
    found.push_back(snapshot.number);
  }
  if (facts.record.snapshot_at.empty()) return;
  std::set<std::int32_t> wanted;
  for (const std::int32_t number : facts.record.snapshot_at) {
    if (number <= record.summary.n_f) wanted.insert(number);
  }
  judge.demand(std::ranges::equal(found, wanted), "/snapshots/number", static_cast<double>(found.size()),
               "one snapshot before each break of -record_snapshot_at, in order");
}

}  // namespace

extern const RecordPart kSnapshotPart;
const RecordPart kSnapshotPart{.name = "snapshot",
                               .group = "snapshots",
                               .meaning = "displacements and forces before the breaks of -record_snapshot_at",
                               .observe = observe_snapshot,
                               .write = write_snapshots,
                               .read = read_snapshots,
                               .same = same_snapshots,
                               .check = check_snapshots};

}  // namespace crackle
