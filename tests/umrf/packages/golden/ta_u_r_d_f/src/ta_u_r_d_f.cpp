#include "ta_u_r_d_f/temoto_action.hpp"

namespace ta_u_r_d_f_action
{

/**
 * Ends "* / everything ${HOME} ]]> ? ?/
 */
class TaURDF : public TemotoAction
{
public:
  void onInit() override
  {
    // Called once, before the first onRun.
  }

  /**
   * The work. It ends within 5 s of a stop, or the engine calls the action failed; it holds while it
   * is paused; and it takes some time, since actions that take none lock up an engine that repeats them.
   *
   * @return true or false, after which the graph may go on differently; an exception is `on_error`
   */
  bool onRun() override
  {
    TEMOTO_PRINT_OF("Running", getName());
    // params_in.class_ is a std::vector<std::string>
    // params_in.NULL_ is a std::vector<bool>
    // params_in.survey_type is a std::string
    // params_in.robot is a boost::any

    // In place of this: short steps, and proceed() between them.
    for (int step = 0; step < 10 && actionOk(); ++step)
    {
      if (!proceed(std::chrono::milliseconds(100)))
      {
        return false;  // stopped
      }
    }

    // params_out.robot is a boost::any
    return actionOk();
  }

  void onPause() override
  {
    TemotoAction::onPause();  // proceed() waits from here on
    // What moves by itself has to be held here.
  }

  void onResume() override
  {
    // What was held goes on here.
    TemotoAction::onResume();
  }

  void onStop() override
  {
    TemotoAction::onStop();  // actionOk() is false already, and proceed() returns
    // What moves by itself has to be stopped here.
  }
};

boost::shared_ptr<::ActionBase> factory()
{
  return boost::shared_ptr<::ActionBase>(new TaURDF());
}

}  // namespace ta_u_r_d_f_action

BOOST_DLL_ALIAS(ta_u_r_d_f_action::factory, TaURDF)
