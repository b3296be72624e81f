#include "crackle/fracture/peak.hpp"
#include "crackle/record/part.hpp"
#include "crackle/record/rows.hpp"

namespace crackle {

namespace {

constexpr const char* kStored = "energy/stored";
constexpr const char* kDissipated = "energy/dissipated";

/// At the peak load: what the network stores, P^2 / (2F), and what the breaks before have dissipated: each
/// u_k^2 (F_k - F_k+1) / 2, the plate being held at u_k = P_k / F_k while its bond breaks.
class ObserveEnergy final : public Observer {
 public:
  explicit ObserveEnergy(SampleRecord& record) : record_(record) {}

  void sample_begins(std::int64_t /*index*/) override {
    record_.number[kStored] = record_.number[kDissipated] = 0;
    breaks_ = 0;
    dissipated_ = 0;
  }
  void sample_resumes(const SampleRecord& begun) override {
    sample_begins(begun.summary.index);
    for (std::size_t k = 0; k < begun.load.size(); ++k) add(begun.load[k], begun.stiffness[k]);
  }
  void bond_breaks(std::int32_t /*number*/, const Critical& critical, Equilibrium& /*equilibrium*/) override {
    add(critical.load, critical.stiffness);
  }

 private:
  void add(double load, double stiffness) {
    if (breaks_ > 0) dissipated_ += displacement_ * displacement_ * (stiffness_ - stiffness) / 2;
    const bool peak = is_new_peak(load, peak_load_, breaks_);
    ++breaks_;
    stiffness_ = stiffness;
    displacement_ = load / stiffness;
    if (!peak) return;
    peak_load_ = load;
    record_.number[kStored] = load * displacement_ / 2;
    record_.number[kDissipated] = dissipated_;
  }

  SampleRecord& record_;
  std::int64_t breaks_ = 0;
  double dissipated_ = 0;  ///< by all breaks but the last
  double peak_load_ = 0;
  double stiffness_ = 0;     ///< F before the last break,
  double displacement_ = 0;  ///< and where the plate was
};

std::unique_ptr<Observer> observe_energy(const PartScene& /*scene*/, SampleRecord& record) {
  return std::make_unique<ObserveEnergy>(record);
}

void write_energy(hid_t file, std::span<const SampleRecord> records) {
  const hdf5::Handle group = hdf5::create_group(file, "energy");
  write_number(file, kStored, records);
  write_number(file, kDissipated, records);
}

void read_energy(hid_t file, std::span<SampleRecord> records) {
  read_number(file, kStored, records);
  read_number(file, kDissipated, records);
}

bool same_energy(const SampleRecord& a, const SampleRecord& b) {
  const auto numbers = [](const SampleRecord& record) {
    std::vector<double> values;
    for (const char* name : {kStored, kDissipated}) {
      const auto found = record.number.find(name);
      if (found != record.number.end()) values.push_back(found->second);
    }
    return values;
  };
  return same_bits(numbers(a), numbers(b));
}

void check_energy(const SampleRecord& record, const RecordFacts& /*facts*/, const Judge& judge) {
  const SampleSummary& summary = record.summary;
  judge.demand_finite("/energy/dissipated", record.number.at(kDissipated));
  judge.demand(record.number.at(kStored) == summary.peak_load * summary.peak_displacement / 2,
               "/energy/stored", record.number.at(kStored),
               "half the peak load times the displacement there");
}

}  // namespace

extern const RecordPart kEnergyPart;
const RecordPart kEnergyPart{
    .name = "energy",
    .group = "energy",
    .meaning = "at the peak load: energy stored, and dissipated by the breaks before",
    .observe = observe_energy,
    .write = write_energy,
    .read = read_energy,
    .same = same_energy,
    .check = check_energy};

}  // namespace crackle
