#pragma once
#include <boost/any.hpp>
#include <boost/config.hpp>

#include <string>

#include "temoto_action_engine/util/error.hpp"
#include "temoto_action_engine/util/logging.hpp"

class ActionParameter
{
public:
  ActionParameter(const std::string& name);
  const boost::any& getData() const;
  unsigned int getDataSize() const;
};

class ActionParameters
{
public:
  bool setParameter(const ActionParameter& parameter, bool merge_new = false);
  bool setParameter(const std::string& name, const std::string& type, const boost::any& payload);
  const ActionParameter& getParameter(const std::string& name) const;
  template <class T>
  T getParameterData(const std::string& name) const
  {
    return boost::any_cast<T>(getParameter(name).getData());
  }
  bool hasParameter(const std::string& name) const;
  bool hasParameter(const ActionParameter& parameter) const;
};

class UmrfNode
{
public:
  const std::string& getFullName() const;
  const ActionParameters& getInputParameters() const;
  ActionParameters& getOutputParametersNc();
  void writeLog(const std::string& message);
};

class BOOST_SYMBOL_VISIBLE ActionBase
{
public:
  virtual void updateParameters(const ActionParameters& parameters_in) = 0;
  bool stopAction();
  const UmrfNode& getUmrfNodeConst() const;
  virtual ~ActionBase() {}

protected:
  virtual bool onRun() = 0;
  virtual void onInit() {}
  virtual void onPause() {}
  virtual void onResume() {}
  virtual void onStop() {}
  virtual void getInputParameters() = 0;
  virtual void setOutputParameters() = 0;
  bool actionOk();
  UmrfNode& getUmrfNode();
  void writeLog(const std::string& message);
};
