/// SIGINT, SIGTERM and SIGHUP: the first one asks the run to end with what is done, the second one ends it at once.
#pragma once

namespace crackle {

/// Catches those that are not ignored (nohup), until the end of the process. Call it after PETSc has started, which has handlers of its own.
void catch_interrupts();

/// A limit on the size of files (SIGXFSZ) makes writing fail, like a full disk, instead of ending the process.
void ignore_file_size_limit();

/// The signal that came, 0: none yet.
[[nodiscard]] int interrupt_signal();

}  // namespace crackle
