/// SIGINT and SIGTERM: the first one asks the run to end with what is done, the second one ends it at once.
#pragma once

namespace crackle {

/// Catches both signals, until the end of the process. Call it after PETSc has started, which has handlers of its own.
void catch_interrupts();

/// The signal that came, 0: none yet.
[[nodiscard]] int interrupt_signal();

}  // namespace crackle
