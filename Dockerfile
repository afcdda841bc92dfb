# Linefix as an image: the wheel with its pinned dependencies and kernels compiled ahead, run by a user without rights.
#   docker build -t linefix .
#   docker run --rm --read-only -p 127.0.0.1:8000:8000 -v linefix:/data -e LINEFIX_ALLOW_ANONYMOUS=1 linefix
ARG BASE_IMAGE=python:3.13-slim

FROM ${BASE_IMAGE} AS build
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore
WORKDIR /src
# Bytecode is compiled to be used unchecked: copying changes the files' times, and every start would compile it again.
ENV COMPILE="/opt/linefix/bin/python -m compileall -q -j 0 --invalidation-mode unchecked-hash"
# The dependencies alone first: a change of the code does not install them again.
COPY requirements requirements
RUN python3 -m venv /opt/tools \
    && /opt/tools/bin/pip install --quiet --constraint requirements/dev.txt hatchling \
    && python3 -m venv --without-pip /opt/linefix \
    && /opt/tools/bin/pip --python /opt/linefix/bin/python install --quiet --no-compile --requirement requirements/runtime.txt \
    && $COMPILE /opt/linefix/lib
COPY pyproject.toml README.md ./
COPY registration registration
COPY vectorization vectorization
COPY association association
COPY simulation simulation
COPY formats formats
COPY linefix linefix
COPY bridge bridge
COPY service service
RUN /opt/tools/bin/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir /wheels . \
    && /opt/tools/bin/pip --python /opt/linefix/bin/python install --quiet --no-compile --no-deps /wheels/*.whl
# For any x86-64 processor: the processor's name is part of a kernel's key, so it has to be the same at run time.
ENV NUMBA_CACHE_DIR=/opt/linefix/kernels NUMBA_CPU_NAME=generic NUMBA_CPU_FEATURES=""
WORKDIR /
RUN PYTHONDONTWRITEBYTECODE=1 /opt/linefix/bin/python -c "from service.work.warmup import warm_up; warm_up()"
RUN cd "$(/opt/linefix/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')" \
    && $COMPILE registration vectorization association simulation formats linefix bridge service \
    && chmod -R u=rwX,go=rX /opt/linefix

FROM ${BASE_IMAGE}
LABEL org.opencontainers.image.title="Linefix" \
      org.opencontainers.image.description="Tells a robot where it is from line segments, and says when it cannot"
RUN useradd --system --uid 10001 --user-group --home-dir /data --no-create-home --shell /usr/sbin/nologin linefix \
    && install --directory --owner=linefix --group=linefix --mode=0750 /data
COPY --from=build /opt/linefix /opt/linefix
ENV PATH=/opt/linefix/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    NUMBA_CACHE_DIR=/opt/linefix/kernels \
    NUMBA_CPU_NAME=generic \
    NUMBA_CPU_FEATURES="" \
    LINEFIX_HOST=0.0.0.0 \
    LINEFIX_PORT=8000 \
    LINEFIX_DATA_DIR=/data
# Once through as at a start: leaves the bytecode of what is used of Python itself, which its slim image comes without.
RUN python -c "import service.process.protocol, service.app; from service.work.warmup import warm_up; warm_up()"
ENV PYTHONDONTWRITEBYTECODE=1
USER linefix
WORKDIR /data
VOLUME /data
EXPOSE 8000
# Without keys (LINEFIX_KEYS) it refuses to start, unless LINEFIX_ALLOW_ANONYMOUS=1 lets everyone in who reaches the port.
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request as u; u.urlopen(f\"http://127.0.0.1:{os.environ['LINEFIX_PORT']}/readyz\", timeout=2)"]
ENTRYPOINT ["linefix", "serve"]
