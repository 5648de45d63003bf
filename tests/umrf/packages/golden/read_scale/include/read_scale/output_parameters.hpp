#pragma once

#include <string>
#include <vector>

namespace read_scale_action
{

struct output_parameters_t
{
  double weight{};
  std::string unit{"kg"};
  bool stable{};
  std::vector<double> samples{};
};

}  // namespace read_scale_action
