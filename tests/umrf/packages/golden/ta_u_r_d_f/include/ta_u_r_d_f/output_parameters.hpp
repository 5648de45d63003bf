#pragma once

#include <boost/any.hpp>
#include <string>
#include <vector>

namespace ta_u_r_d_f_action
{

struct output_parameters_t
{
  boost::any robot{};
};

}  // namespace ta_u_r_d_f_action
