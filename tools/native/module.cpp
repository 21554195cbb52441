// hexload_native: the plant's formulas and the firmware's C, as Python sees them.
#include "bindings.hpp"

NB_MODULE(HEXLOAD_MODULE, module) {
    module.doc() = "hexload's plant (host_sim) and firmware. Conventions: firmware/include/hexload/config.h.";
    bind_sim(module);
    bind_firmware(module);
    bind_estimator(module);
#ifdef HEXLOAD_MODULE_HAS_BUS
    bind_bus(module);
#endif
}
