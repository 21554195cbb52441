// One function for each part of the module.
#pragma once

#include <nanobind/nanobind.h>

void bind_sim(nanobind::module_& module);       // geometry, kinematics, dynamics, files of the plant
void bind_firmware(nanobind::module_& module);  // the estimator's C
void bind_estimator(nanobind::module_& module); // the estimators, sample by sample
void bind_bus(nanobind::module_& module);       // the CAN codec's C
