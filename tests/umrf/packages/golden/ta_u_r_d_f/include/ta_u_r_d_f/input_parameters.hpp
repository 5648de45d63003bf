#pragma once

#include <boost/any.hpp>
#include <string>
#include <vector>

namespace ta_u_r_d_f_action
{

struct input_parameters_t
{
  std::vector<std::string> class_{};
  std::vector<bool> NULL_{};
  std::string survey_type{};
  boost::any robot{};
};

}  // namespace ta_u_r_d_f_action
