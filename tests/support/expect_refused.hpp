/// What a user's mistake must lead to: an InputError on one line that names what is wrong.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "crackle/base/error.hpp"

namespace crackle::test {

/// Runs `act`, which must throw an InputError (or another `Error`) whose message holds every part.
template <class Error = InputError, class Act>
void expect_refused(Act act, const std::vector<std::string>& parts) {
  try {
    act();
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.find('\n'), std::string::npos) << "more than one line: " << what;
    for (const std::string& part : parts) {
      EXPECT_NE(what.find(part), std::string::npos) << "no \"" << part << "\" in: " << what;
    }
    return;
  }
  ADD_FAILURE() << "nothing was refused; expected: " << (parts.empty() ? "" : parts.front());
}

}  // namespace crackle::test
