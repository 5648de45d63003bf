#pragma once

#include <string>
#include <vector>

namespace move_t_c_p_action
{

struct input_parameters_t
{
  struct pose_t
  {
    struct position_t
    {
      double x{};
      double y{};
      double z{};
    };
    position_t position{};
    struct orientation_t
    {
      double yaw{};
    };
    orientation_t orientation{};
  };
  pose_t pose{};
  struct position_t
  {
    std::string frame{};
  };
  position_t position{};
  double speed{};
};

}  // namespace move_t_c_p_action
