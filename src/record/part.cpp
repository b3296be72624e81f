#include "crackle/record/part.hpp"

#include <array>
#include <cstring>

namespace crackle {

extern const RecordPart kBreaksPart;
extern const RecordPart kProfilePart;
extern const RecordPart kSnapshotPart;
extern const RecordPart kEnergyPart;

std::span<const RecordPart* const> record_parts() {
  static const std::array kParts = {
      &kBreaksPart,
      &kProfilePart,
      &kSnapshotPart,
      &kEnergyPart,
  };
  return kParts;
}

std::vector<std::string> record_words() {
  std::vector<std::string> words;
  for (const RecordPart* part : record_parts()) words.emplace_back(part->name);
  words.emplace_back("network");
  return words;
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

}  // namespace crackle
