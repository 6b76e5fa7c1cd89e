# The project with its environment, made by the same script and lock file as without a container:
#   docker build -t pdrom .
#   docker run --rm -v pdrom-results:/home/visitor/pdrom/results pdrom --configfile config/tiny.yaml
#   docker run --rm pdrom test       (downloads the tests' tools)
FROM python:3.12-slim-bookworm

# a version of git that is pinned here would vanish from Debian's mirrors with its next update
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends git \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home --uid 1000 visitor \
    && install --directory --owner visitor /home/visitor/pdrom/results

WORKDIR /home/visitor/pdrom
COPY --chown=visitor . .
RUN chown visitor .
USER 1000
ENV PATH=/home/visitor/pdrom/.venv/bin:$PATH

# makes .venv from requirements.lock
RUN ./reproduce run pdrom --help

VOLUME /home/visitor/pdrom/results
ENTRYPOINT ["./reproduce"]
