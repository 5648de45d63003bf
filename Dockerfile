# syntax=docker/dockerfile:1.10
# Two images: `editor` (graphs, versions, the page; also everything with the simulator) and `runner`
# (the side of the robots, with the distribution's rclpy). What is done in them stands in
# scripts/image, which tests also run outside of any container.

# Tags of ROS carry no version: name digests here (`ros@sha256:…`) for builds that can be repeated.
# Robots are reached from the smaller one, without compilers; the larger one builds.
ARG ROS_IMAGE=ros:jazzy-ros-core-noble
ARG ROS_BUILD_IMAGE=ros:jazzy-ros-base-noble

FROM node:22.16.0-bookworm-slim AS page
WORKDIR /source/frontend
COPY frontend/package.json frontend/package-lock.json ./
RUN npm ci --no-audit --no-fund
COPY frontend ./
RUN npm run build

FROM python:3.12.11-slim-bookworm AS help
WORKDIR /source
COPY requirements ./requirements
COPY scripts ./scripts
COPY README.md CONTRIBUTING.md CHANGELOG.md ./
COPY frontend/public ./frontend/public
COPY frontend/src/api/schema ./frontend/src/api/schema
COPY docs ./docs
RUN scripts/image help /out

FROM python:3.12.11-slim-bookworm AS wheel
WORKDIR /source
COPY pyproject.toml README.md LICENSE ./
COPY requirements ./requirements
COPY scripts ./scripts
COPY migrations ./migrations
COPY server ./server
COPY --from=page /source/frontend/dist ./frontend/dist
COPY --from=help /out ./build/help
RUN scripts/image wheel /out

FROM python:3.12.11-slim-bookworm AS editor-environment
COPY requirements/run.txt scripts/image /opt/build/
COPY --from=wheel /out /opt/build/wheel
RUN /opt/build/image install /opt/action-assistant /opt/build

FROM python:3.12.11-slim-bookworm AS editor
COPY scripts/image /opt/build/
COPY --from=editor-environment /opt/action-assistant /opt/action-assistant
RUN /opt/build/image user && python3 -m pip uninstall --quiet --yes --root-user-action=ignore pip
ENV PATH=/opt/action-assistant/bin:$PATH PYTHONDONTWRITEBYTECODE=1
USER 10001:10001
VOLUME /data
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=4s --start-period=30s CMD ["/opt/build/image", "healthy", "8000"]
ENTRYPOINT ["action-assistant"]
CMD ["editor", "--data", "/data", "--host", "0.0.0.0"]

FROM ${ROS_BUILD_IMAGE} AS runner-environment
RUN apt-get update -qq \
    && apt-get install -y -qq --no-install-recommends python3-venv \
    && rm -rf /var/lib/apt/lists/*
COPY requirements/run.txt scripts/image /opt/build/
COPY ros /opt/build/ros
COPY --from=wheel /out /opt/build/wheel
RUN /opt/build/image messages /opt/ros/jazzy /opt/build/ros /opt/temoto \
    && /opt/build/image install /opt/action-assistant /opt/build --with-ros

FROM ${ROS_IMAGE} AS runner
RUN apt-get update -qq \
    && apt-get install -y -qq --no-install-recommends ros-jazzy-rmw-cyclonedds-cpp \
    && rm -rf /var/lib/apt/lists/*
COPY scripts/image /opt/build/
COPY --from=runner-environment /opt/temoto /opt/temoto
COPY --from=runner-environment /opt/action-assistant /opt/action-assistant
RUN /opt/build/image user
ENV PATH=/opt/action-assistant/bin:$PATH PYTHONDONTWRITEBYTECODE=1 ROS_LOG_DIR=/tmp
USER 10001:10001
VOLUME /data
EXPOSE 8001
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=4s --start-period=30s CMD ["/opt/build/image", "healthy", "8001"]
ENTRYPOINT ["/opt/build/image", "sourced", "action-assistant"]
CMD ["runner", "--data", "/data"]
