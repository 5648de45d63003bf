# syntax=docker/dockerfile:1.10
# Two images: `editor` (graphs, versions, the page; also everything with the simulator) and `runner`
# (the side of the robots, with the distribution's rclpy). What is done in them stands in
# scripts/image, which tests also run outside of any container. What changes rarely comes first, so
# that a changed line of Python builds anew the package and nothing below it.

# Tags of ROS carry no version: name digests here (`ros@sha256:…`) for builds that can be repeated.
# Robots are reached from the smaller one, without compilers; the larger one builds.
ARG ROS_IMAGE=ros:jazzy-ros-core-noble
ARG ROS_BUILD_IMAGE=ros:jazzy-ros-base-noble
ARG VERSION=0.2.0.dev0
ARG SOURCE_COMMIT=

# The page and the wheel are the same for every architecture.
FROM --platform=$BUILDPLATFORM node:22.16.0-bookworm-slim AS page
WORKDIR /source/frontend
COPY frontend/package.json frontend/package-lock.json ./
RUN npm ci --no-audit --no-fund
COPY frontend ./
RUN npm run build

FROM --platform=$BUILDPLATFORM python:3.12.11-slim-bookworm AS help
WORKDIR /source
COPY requirements/site.txt ./requirements/
COPY scripts/image ./scripts/
RUN scripts/image help-tools /opt/help
COPY README.md CONTRIBUTING.md CHANGELOG.md LICENSE ./
COPY frontend/public ./frontend/public
COPY frontend/src/api/schema ./frontend/src/api/schema
# Tables of codes are made from these; the rest of the program is not needed, and changes more often.
COPY server/action_assistant/__init__.py server/action_assistant/safe_text.py ./server/action_assistant/
COPY server/action_assistant/system/__init__.py server/action_assistant/system/diagnostics.py ./server/action_assistant/system/
COPY server/action_assistant/umrf/__init__.py server/action_assistant/umrf/codes.py server/action_assistant/umrf/model.py ./server/action_assistant/umrf/
COPY docs ./docs
RUN scripts/image help /opt/help /out

FROM --platform=$BUILDPLATFORM python:3.12.11-slim-bookworm AS wheel
WORKDIR /source
COPY requirements/build.txt ./requirements/
COPY scripts/image scripts/build_version.py scripts/wheel_commit.py ./scripts/
RUN scripts/image back-end /opt/back-end
COPY --from=page /source/frontend/dist ./frontend/dist
COPY --from=help /out ./build/help
COPY pyproject.toml README.md LICENSE ./
COPY migrations ./migrations
COPY server ./server
ARG VERSION
ARG SOURCE_COMMIT
RUN SOURCE_VERSION="$VERSION" scripts/image wheel /opt/back-end /out

FROM python:3.12.11-slim-bookworm AS editor-dependencies
COPY requirements/run.txt scripts/image /opt/build/
RUN /opt/build/image dependencies /opt/action-assistant /opt/build/run.txt

FROM editor-dependencies AS editor-package
COPY --from=wheel /out /opt/build/wheel
RUN /opt/build/image package /opt/action-assistant /opt/build/wheel /opt/package

FROM python:3.12.11-slim-bookworm AS editor
COPY scripts/image /opt/build/
RUN /opt/build/image user
COPY --from=editor-dependencies /opt/action-assistant /opt/action-assistant
COPY --from=editor-package /opt/package /opt/action-assistant
ENV ACTION_ASSISTANT_DATA=/data PYTHONDONTWRITEBYTECODE=1
USER 10001:10001
VOLUME /data
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=5s --start-period=30s CMD ["/opt/build/image", "healthy", "editor"]
ENTRYPOINT ["action-assistant"]
CMD ["editor", "--host", "0.0.0.0"]
ARG VERSION
ARG SOURCE_COMMIT
LABEL org.opencontainers.image.title="TeMoto Action Assistant: editor" \
    org.opencontainers.image.description="Graphs, versions, the page; also everything with the simulator" \
    org.opencontainers.image.licenses="Apache-2.0" \
    org.opencontainers.image.version="$VERSION" \
    org.opencontainers.image.revision="$SOURCE_COMMIT"

FROM ${ROS_BUILD_IMAGE} AS messages
COPY scripts/image /opt/build/
COPY ros /opt/build/ros
RUN /opt/build/image messages /opt/ros/jazzy /opt/build/ros /opt/temoto

FROM ${ROS_BUILD_IMAGE} AS runner-dependencies
RUN apt-get update -qq \
    && apt-get install -y -qq --no-install-recommends python3-venv \
    && rm -rf /var/lib/apt/lists/*
COPY requirements/run.txt scripts/image /opt/build/
RUN /opt/build/image dependencies /opt/action-assistant /opt/build/run.txt

FROM runner-dependencies AS runner-package
COPY --from=wheel /out /opt/build/wheel
RUN /opt/build/image package /opt/action-assistant /opt/build/wheel /opt/package

FROM ${ROS_IMAGE} AS runner
RUN apt-get update -qq \
    && apt-get install -y -qq --no-install-recommends ros-jazzy-rmw-cyclonedds-cpp \
    && rm -rf /var/lib/apt/lists/*
COPY scripts/image /opt/build/
RUN /opt/build/image user
COPY --from=messages /opt/temoto /opt/temoto
COPY --from=runner-dependencies /opt/action-assistant /opt/action-assistant
COPY --from=runner-package /opt/package /opt/action-assistant
ENV ACTION_ASSISTANT_DATA=/data PYTHONDONTWRITEBYTECODE=1 ROS_LOG_DIR=/tmp
USER 10001:10001
VOLUME /data
EXPOSE 8001
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=5s --start-period=30s CMD ["/opt/build/image", "healthy", "runner"]
ENTRYPOINT ["action-assistant"]
CMD ["runner"]
ARG VERSION
ARG SOURCE_COMMIT
LABEL org.opencontainers.image.title="TeMoto Action Assistant: runner" \
    org.opencontainers.image.description="The side of the robots: runs and Stop, over ROS 2" \
    org.opencontainers.image.licenses="Apache-2.0" \
    org.opencontainers.image.version="$VERSION" \
    org.opencontainers.image.revision="$SOURCE_COMMIT"
