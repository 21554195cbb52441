// Commands on LCM that change load and sensors of a running simulator, for who watches a run by the clock.
#pragma once

#include <hexload_sim/simulator.hpp>

#include <hexload_lcm/namespace.hpp>
#include <hexload_lcm/plant_command_t.hpp>
#include <hexload_lcm/session.hpp>

#include <functional>
#include <string>

namespace hexload::sim {

class LcmPlantCommands {
  public:
    // `simulator` outlives this. `report` is told in words what was done, or why not. Throws
    // message::SessionError.
    LcmPlantCommands(const std::string& url, Simulator& simulator,
                     std::function<void(const std::string&)> report);

    // Once per tick: carries out what has come, without waiting.
    void take();

  private:
    void take(const plant_command_t& command);
    std::string set_load(const plant_command_t& command);
    std::string set_sensor_fault(const plant_command_t& command);

    message::Session session_;
    Simulator& simulator_;
    std::function<void(const std::string&)> report_;
};

} // namespace hexload::sim
